"""The command that repeats a run."""

import shlex

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import printable
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig
from beacon_mj.eval.runs.variants import text_of
from beacon_mj.planners.registry import PAPER


def command_of(config: RunConfig) -> str:
    """Return the `beacon-mj eval` command with the options of a run.

    No command can name a class that was handed over in Python; it stands there as
    `python:module:Class`, which `eval` refuses.
    """
    words = ["beacon-mj", "eval"]
    planners = {entry.base: entry for entry in config.planners}
    names = [entry.spec for entry in planners.values()]
    if set(PAPER) <= set(names):
        names = ["all", *(n for n in names if n not in PAPER)]
    for name in names:
        words += ["--planner", name]
    settings = [text for entry in planners.values() for text in _settings(entry)]
    for text in (*settings, *_protocol(config.protocol)):
        words += ["--set", text]
    for target, values in _varied(config).items():
        separator = ";" if any("," in value for value in values) else ","
        words += ["--vary", f"{target}={separator.join(values)}"]
    if config.scene_dir is None:
        for family in config.families:
            words += ["--family", family]
    for option, value in (
        ("--scenes-per-family", config.scenes_per_family),
        ("--seed", config.seed),
        ("--perception", config.perception),
        ("--scene-dir", config.scene_dir),
        ("--templates", config.templates),
    ):
        if value is not None:
            words += [option, str(value)]
    return printable(shlex.join(words))


def _settings(entry: PlannerEntry) -> list[str]:
    """Return what was set in a planner, without what is varied in it."""
    return [
        f"{entry.base}.{field}={value}"
        for field, value in entry.settings.items()
        if f"{entry.base}.{field}" not in entry.varied
    ]


def _varied(config: RunConfig) -> dict[str, list[str]]:
    """Return the values of each varied setting, in the order in which they came."""
    found: dict[str, dict[str, None]] = {}
    for entry in config.planners:
        for target, value in entry.varied.items():
            found.setdefault(target, {})[value] = None
    return {target: [*values] for target, values in found.items()}


def _protocol(protocol: Protocol) -> list[str]:
    default = Protocol()
    return [
        f"protocol.{field}={text_of(value)}"
        for field in Protocol.__struct_fields__
        if (value := getattr(protocol, field)) != getattr(default, field)
    ]
