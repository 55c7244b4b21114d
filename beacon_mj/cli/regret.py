"""`beacon-mj regret`."""

from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


def regret(
    *,
    planner: Annotated[str, Parameter(help="Whose regret.")],
    settings: options.SetOption = (),
    protocol: options.ProtocolOption = None,
    suite: options.Suite = (),
    family: options.Family = (),
    scenes_per_family: Annotated[
        options.ScenesPerFamily | None, Parameter(help=options.SCENES_HELP)
    ] = None,
    seed: options.Seed = 0,
    perception: options.Perception = None,
    templates: options.Templates = None,
    workers: options.Workers = None,
    json: options.Json = False,
) -> None:
    """Compare a planner with the clairvoyant, and say what the difference is paid for.

    The planner crosses every scene three times: told everything, sensing only what is
    near, and with uncertain classes.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark, show, show_json

    found = beacon_mj.regret(
        planner,
        settings=settings,
        protocol=protocol,
        families=family,
        suite=suite,
        scenes_per_family=scenes_per_family,
        seed=seed,
        perception=perception or "noisy",
        templates=templates,
        workers=workers,
        progress=beacon_mj.show_progress,
        tell=lambda line: remark(f"note: {line}"),
    )
    if json:
        show_json([price._asdict() for price in found.prices])
    else:
        show(found)
