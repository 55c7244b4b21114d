"""`beacon-mj generate`, `families`, and `view`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from beacon_mj.cli import options


def generate(
    *,
    out: Annotated[Path, Parameter(help="Folder to write to; new or empty.")],
    suite: options.Suite = (),
    family: options.Family = (),
    scenes_per_family: Annotated[
        options.ScenesPerFamily | None, Parameter(help=options.SCENES_HELP)
    ] = None,
    seed: options.Seed = 0,
    perception: options.Perception = None,
    templates: options.Templates = None,
    certify: Annotated[
        options.Flag,
        Parameter(help="Then solve each in MuJoCo, as `beacon-mj certify` does."),
    ] = False,
) -> int:
    """Write certified scenes: scene_0000.json, and its world as scene_0000.xml.

    Several families go to a folder each. The same options give the same bytes.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    beacon_mj.generate_scenes(
        out,
        families=family,
        suite=suite,
        scenes_per_family=scenes_per_family,
        seed=seed,
        perception=perception or "noisy",
        templates=templates,
        on_folder=lambda folder, name, n: remark(f"{folder}: {n} scenes of {name}"),
        tell=lambda line: remark(f"note: {line}"),
    )
    if not certify:
        return 0
    from beacon_mj.cli.certify import certify_folder

    return certify_folder(out)


def families(*, suite: options.Suite = (), templates: options.Templates = None) -> None:
    """List the scene families: suite, layout, obstacles, value of learning, and file.

    The value of learning is what the best policy that learns from stage to stage
    saves, in expectation, over the best one that does not; promised for every scene.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import show

    show(beacon_mj.list_families(templates, suite=suite))


def view(
    scene: Path,
    /,
    *,
    png: Annotated[
        Path | None, Parameter(help="Write a picture instead of opening a window.")
    ] = None,
) -> None:
    """Look at a scene: in MuJoCo's viewer, or as a picture.

    Parameters
    ----------
    scene
        A scene's JSON file.
    """
    import beacon_mj
    from beacon_mj.cli.views.console import remark

    found = beacon_mj.load_scene(scene)
    if png is None:
        beacon_mj.view_scene(found)
    else:
        remark(str(beacon_mj.render_scene(found, png)))
