"""A run as one self-contained HTML file: no network, no script of its own."""

import base64
import hashlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import msgspec
from jinja2 import Environment, PackageLoader, StrictUndefined
from msgspec import UNSET

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError, printable, unknown
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.report import figures, tables
from beacon_mj.eval.report.command import command_of
from beacon_mj.eval.report.episodes import (
    Panel,
    Pick,
    failures,
    log_of,
    logged,
    panel,
    picks,
    push_of,
    reasons,
    replay,
)
from beacon_mj.eval.runs.overrides import dotted
from beacon_mj.eval.runs.run_folder import TABLE
from beacon_mj.eval.statistics.compare import Comparison, compare_pairs
from beacon_mj.eval.statistics.grouping import NO_SUITE, shown
from beacon_mj.eval.statistics.oracles import NOTE
from beacon_mj.eval.statistics.pairing import (
    Arm,
    comparisons,
    default_baseline,
    match,
)
from beacon_mj.eval.statistics.results import Results
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.studies.calibration import (
    FIRST,
    PUSHED_FIRST,
    PUSHED_LAST,
    Beliefs,
    read_beliefs,
    reliability,
)

MOST_LOGS = 100  #: Of one planner, from which its calibration is read.
FOCUS = "beacon"  #: Planner whose episodes are shown, if the run has it.


class Figure(NamedTuple):
    """A picture for the page: source and caption."""

    source: str
    caption: str


class Missions(NamedTuple):
    """What the page shows of the missions of one family."""

    results: tables.Table
    differences: tables.Table
    curves: Figure


class Calibration(NamedTuple):
    """What is known about one planner's beliefs: a diagram, or why there is none."""

    planner: str
    figure: Figure | None
    note: str


class _Page(str):
    """The text of another page, which stays as it is."""


def render_report(
    run: Results,
    baseline: str | None = None,
    *,
    with_replay: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> str:
    """Return the page of a run, finished or not.

    Args:
        run: The run.
        baseline: Planner that the others are compared with; see `default_baseline`.
        with_replay: Whether to embed a 3-D replay.
        tell: Called with what is done next.

    Raises:
        RunError: If the run has no planner of the baseline's name.
    """
    if baseline is not None and baseline not in run.planners:
        raise RunError(f"{run.folder}: {unknown('planner', baseline, run.planners)}")
    rows = [row for own in run.planners.values() for row in own]
    tell("tables")
    summary = _summary(run)
    tell("paired differences")
    base, found = _compared(run, baseline)
    made = _tables(run, summary, found)
    tell("beliefs and episodes, from the logs")
    failed = failures(run.folder, run.planners)
    chosen = _chosen(run)
    names = [*chosen, *run.planners]
    focus = FOCUS if FOCUS in chosen else names[0]
    pages = _replay([*chosen.get(focus, []), *failed]) if with_replay else None
    page: str = template().render(
        policy=_policy(pages),
        note=NOTE,
        oracles=summary["oracles"],
        run=_facts(run, rows),
        baseline=base,
        results=made.results,
        differences=made.differences,
        left_out=max((c.left_out for c in found), default=0),
        outcomes=made.outcomes,
        reasons=made.reasons,
        figures=_figures(summary, rows),
        missions=made.missions,
        beliefs=made.beliefs,
        calibrations=[*calibrations(run)],
        focus=focus,
        failures=[_picture(panel(pick)) for pick in failed],
        choices=[
            {"planner": name, "panels": [_picture(panel(pick)) for pick in own]}
            for name, own in chosen.items()
        ],
        unshown=_unshown(run),
        replay=pages,
    )
    return page


def page_tables(run: Results, baseline: str | None = None) -> list[str]:
    """Return the tables of a run's page, as they stand in it; see `render_report`."""
    found = _compared(run, baseline)[1]
    made = _tables(run, _summary(run), found)
    macro = template("table.html.j2").module.table
    return [
        str(macro(each))
        for each in (
            *made.results,
            made.outcomes,
            made.reasons,
            *made.differences,
            *(t for m in made.missions for t in (m.results, m.differences)),
            made.beliefs,
        )
        if each is not None and each.groups
    ]


class _Tables(NamedTuple):
    """The tables of a page."""

    results: list[tables.Table]
    differences: list[tables.Table]
    outcomes: tables.Table
    reasons: tables.Table
    beliefs: tables.Table | None
    missions: list[Missions]


def _tables(
    run: Results, summary: dict[str, Any], found: Sequence[Comparison]
) -> _Tables:
    families = dict.fromkeys(f for own in summary["tables"].values() for f in own)
    names = shown([*families])
    return _Tables(
        [tables.results(summary, name) for name in names],
        [tables.differences(found, name) for name in names],
        tables.outcomes(summary),
        tables.reasons(reasons(run.planners)),
        tables.beliefs(summary),
        _missions(summary, found),
    )


def _summary(run: Results) -> dict[str, Any]:
    """Return a run's summary with the planners in the order in which they came."""
    summary = summarize([row for own in run.planners.values() for row in own])
    tables_by = summary["tables"]
    summary["tables"] = {name: tables_by[name] for name in run.planners}
    if missions := summary.get("missions"):
        summary["missions"] = {n: missions[n] for n in run.planners if n in missions}
    return summary


def template(name: str = "report.html.j2") -> Any:
    """Return a template of this package, whose values are escaped and printable."""
    environment = Environment(
        loader=PackageLoader("beacon_mj.eval.report"),
        autoescape=True,
        finalize=_shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def _shown(value: Any) -> Any:
    """Return a value for the page: a text as what can be printed of it."""
    return printable(value) if type(value) is str else value


def _policy(replay: dict[str, str] | None) -> str:
    """Return what the page may do: show what is in it, and load nothing.

    The page within it that shows a replay has the same policy, and its own scripts.
    """
    if replay is None or not replay["page"]:
        return "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    from beacon_mj.rendering.html import POLICY

    return POLICY


def _compared(run: Results, baseline: str | None) -> tuple[str, list[Comparison]]:
    """Return the baseline and the comparisons with it; none if it is alone."""
    base = default_baseline(run) if baseline is None else baseline
    if len(run.planners) == 1 and base in run.planners:
        return base, []
    pairs = comparisons([run], base)
    shared = [pair for pair in pairs if _hashes(pair[0]) & _hashes(pair[1])]
    return base, compare_pairs([match(a, b, common=True) for a, b in shared])


def _facts(run: Results, rows: Sequence[Row]) -> dict[str, Any]:
    """Return what the head and the foot of the page say about the run."""
    config = run.config
    hashes = sorted({row.scene_sha256 for row in rows})
    return {
        "name": run.folder.resolve().name,
        "episodes": len(rows),
        "scenes": len(hashes),
        "planners": len(run.planners),
        "suites": _suites(rows),
        "notes": run.notes(),
        "finished": (run.folder / TABLE).is_file(),
        "solved": sum(row.success for row in rows),
        "seed": config.seed,
        "perception": config.perception or "as stored in the scenes",
        "digest": hashlib.sha256("".join(hashes).encode()).hexdigest(),
        "versions": config.versions,
        "protocol": _protocol(config.protocol),
        "configs": {entry.name: dotted(entry.config) for entry in config.planners},
        "command": command_of(config),
    }


def _protocol(protocol: Protocol) -> dict[str, Any]:
    """Return the protocol's fields, of a robot its name and the hash of its file."""
    fields: dict[str, Any] = msgspec.to_builtins(protocol)
    if protocol.robot is not UNSET:
        fields["robot"] = f"{protocol.robot}, SHA-256 {protocol.robot.sha256}"
    return fields


def _suites(rows: Sequence[Row]) -> list[str]:
    """Return the suites of the scenes, and `no suite` beside others for the rest."""
    found = [*dict.fromkeys(row.suite for row in rows)]
    if found == [None]:
        return []
    return [NO_SUITE if suite is None else suite for suite in found]


def _figures(summary: dict[str, Any], rows: Sequence[Row]) -> dict[str, Any]:
    touched = any(row.filtered_peak_force_n > 0.0 for row in rows)
    forces = Figure(_data(figures.peak_forces(rows)), "Peak forces by planner")
    return {
        "wide": _data(figures.overview(summary, wide=True)),
        "narrow": _data(figures.overview(summary, wide=False)),
        "pareto": [
            Figure(
                _data(figures.pareto(summary, column, label)), f"Success and {label}"
            )
            for column, label in figures.PARETO
        ],
        "forces": [forces] if touched else [],
    }


def _missions(summary: dict[str, Any], found: Sequence[Comparison]) -> list[Missions]:
    """Return what there is to show of missions, family by family."""
    missions = summary.get("missions", {})
    families = dict.fromkeys(family for own in missions.values() for family in own)
    return [
        Missions(
            tables.missions(summary, family),
            tables.differences(found, family, whole_missions=True),
            Figure(
                _data(figures.learning_curves(missions, family, summary["oracles"])),
                f"Learning curves: steps by day, {family}",
            ),
        )
        for family in families
    ]


def calibrations(run: Results) -> Iterable[Calibration]:
    """Yield what the logs say about the beliefs of every planner that reports any."""
    for name, rows in run.planners.items():
        if all(row.brier_prior is None for row in rows):
            continue
        found = logged(run.folder, rows)
        if 0 < len(found) < len(rows):
            yield Calibration(
                name,
                None,
                f"{len(found)} of {len(rows)} episodes left a log: those that did may "
                "differ from the others.",
            )
            continue
        # Evenly spaced: reading every log of a large run would take minutes.
        some = found[:: max(1, -(-len(found) // MOST_LOGS))]
        logs = [log_of(run.folder, row) for row in some]
        yield _calibration(name, read_beliefs(logs), len(rows))


def _calibration(name: str, found: Beliefs, episodes: int) -> Calibration:
    note = f"From {found.logs} logs of {episodes} episodes."
    if found.unreadable:
        note += f" {found.unreadable} logs could not be read."
    if not found.logs:
        return Calibration(name, None, "The run has no logs to read its beliefs from.")
    curves = {
        what: reliability(found.forecasts[what])
        for what in (FIRST, PUSHED_FIRST, PUSHED_LAST)
    }
    curves = {what: curve for what, curve in curves.items() if curve.n}
    if not curves:
        return Calibration(name, None, f"{note} They hold no beliefs.")
    if PUSHED_LAST not in curves:
        note += " No obstacle was pushed."
    errors = "; ".join(f"{what} {c.error:.3f}" for what, c in curves.items())
    caption = f"{name}. {note} Expected calibration error: {errors}."
    source = _data(figures.reliability_diagram(curves))
    return Calibration(name, Figure(source, caption), note)


def _picture(drawn: Panel) -> dict[str, str]:
    source = _data(drawn.svg) if drawn.svg else ""
    return {"source": source, "caption": drawn.caption, "problem": drawn.problem}


def _chosen(run: Results) -> dict[str, list[Pick]]:
    """Return what to show of the successes of each planner that left logs."""
    alone = len(run.planners) == 1
    found = {
        name: picks(run.folder, rows, by_family=alone)
        for name, rows in run.planners.items()
    }
    return {name: own for name, own in found.items() if own}


def _unshown(run: Results) -> list[str]:
    """Return what is said of planners whose episodes did not all leave a log."""
    return [
        f"{name}: {n} of {len(rows)} episodes left a log, so none is shown as the "
        "median."
        for name, rows in run.planners.items()
        if 0 < (n := len(logged(run.folder, rows))) < len(rows)
    ]


def _replay(chosen: Sequence[Pick]) -> dict[str, str] | None:
    """Return the replay of the episode with most pushing, else of the first shown."""
    if not chosen:
        return None
    moving = push_of([pick.row for pick in chosen])
    pick = next((p for p in chosen if p.row == moving), chosen[0])
    drawn = replay(pick)
    return {
        "page": _Page(drawn.svg),
        "caption": drawn.caption,
        "problem": drawn.problem,
    }


def _data(svg: str) -> str:
    """Return an SVG as a data URI, which keeps its ids apart from others'."""
    encoded = base64.b64encode(svg.encode()).decode()
    return f"data:image/svg+xml;base64,{encoded}"


def _hashes(arm: Arm) -> set[str]:
    return {row.scene_sha256 for row in arm.rows}
