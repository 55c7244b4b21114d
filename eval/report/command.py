"""The command that repeats a run."""

import shlex

from beacon_mj.episode.protocol import Protocol
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.overrides import Settings
from beacon_mj.planners.registry import PAPER


def command_of(config: RunConfig) -> str:
    """Return the `beacon-mj eval` command with the options of a run."""
    words = ["beacon-mj", "eval"]
    names = [entry.spec for entry in config.planners]
    if set(PAPER) <= set(names):
        names = ["all", *(n for n in names if n not in PAPER)]
    for name in names:
        words += ["--planner", name]
    for text in (*_settings({e.name: e.settings for e in config.planners}),
                 *_protocol(config.protocol)):  # fmt: skip
        words += ["--set", text]
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
    return shlex.join(words)


def _settings(settings: Settings) -> list[str]:
    return [
        f"{target}.{field}={value}"
        for target, values in settings.items()
        for field, value in values.items()
    ]


def _protocol(protocol: Protocol) -> list[str]:
    default = Protocol()
    return [
        f"protocol.{field}={value}"
        for field in Protocol.__struct_fields__
        if (value := getattr(protocol, field)) != getattr(default, field)
    ]
