"""Options that several commands share, with their help.

Nothing heavy is imported here: help must be fast.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter, Token
from cyclopts.validators import Number

from beacon_mj.constants import WHOLE_NUMBERS

# The same as beacon_mj.scene.Profile, whose module takes a second to import.
Profile = Literal["truth", "noisy", "misleading"]
Log = Literal["all", "failures", "none"]


def whole(kind: type, tokens: Sequence[Token]) -> int:
    """Return a whole number; cyclopts itself would round 1.5 without a word."""
    text = tokens[0].value
    if not re.fullmatch(r"[+-]?[0-9]+", text):
        raise ValueError(f"expected a whole number but it was {text!r}.")
    return int(text)


def within(name: str) -> Number:
    """Return the validator of a number of `WHOLE_NUMBERS`."""
    low, high = WHOLE_NUMBERS[name]
    return Number(gte=low, lte=high)


Family = Annotated[
    tuple[str, ...],
    Parameter(
        name="--family",
        negative=(),
        show_default=False,
        consume_multiple=True,
        help="Scene families; several, or repeated. Those of suite paper-v1 if unsaid.",
    ),
]
Suite = Annotated[
    tuple[str, ...],
    Parameter(
        name="--suite",
        negative=(),
        show_default=False,
        consume_multiple=True,
        help="Suites, in place of families: paper-v1, learning-v1, hard-v1, scale-v1, "
        "one that your own families name, or all; several, or repeated.",
    ),
]
Seed = Annotated[
    int,
    Parameter(
        converter=whole,
        validator=within("seed"),
        help="Seed of scenes, perception and planners.",
    ),
]
Perception = Annotated[
    Profile | None,
    Parameter(
        help="What planners are told about class and material. Default: noisy, or "
        "what stored scenes say."
    ),
]
Templates = Annotated[
    Path | None, Parameter(help="Folder of your own family templates.")
]
SCENES_HELP = (
    "Scenes per family; 100 by default, or the whole rounds of latent worlds nearest "
    "to it."
)
ScenesPerFamily = Annotated[
    int,
    Parameter(
        name=["--scenes-per-family", "-n"],
        converter=whole,
        validator=within("scenes_per_family"),
    ),
]
SetOption = Annotated[
    tuple[str, ...],
    Parameter(
        name="--set",
        negative=(),
        show_default=False,
        consume_multiple=True,
        help="planner.field=value, or protocol.field=value; several, or repeated.",
    ),
]
ProtocolOption = Annotated[
    str | None,
    Parameter(
        name="--protocol",
        help="Preset of the protocol: paper, the default, or realistic, with a sensor "
        "that is occluded, misses, and errs. --set protocol.field=value goes on top.",
    ),
]
# The same as beacon_mj.episode.protocol has, whose module takes a second to import.
World = Literal["mujoco", "planar"]
WorldOption = Annotated[
    World | None,
    Parameter(
        name="--world",
        help="World of all episodes: mujoco, the default, or planar, the paper's; "
        "--set protocol.planar_push=limit-surface has obstacles turn in that.",
    ),
]
VaryOption = Annotated[
    tuple[str, ...],
    Parameter(
        name="--vary",
        negative=(),
        show_default=False,
        consume_multiple=True,
        help="planner.field=a,b,c, or protocol.field=a,b,c: run with each combination "
        "of values, as a planner and with a column of its own; several, or repeated.",
    ),
]
Workers = Annotated[
    int | None,
    Parameter(
        converter=whole,
        validator=within("workers"),
        help="Processes; one per usable core by default.",
    ),
]
Report = Annotated[
    bool,
    Parameter(
        negative="--no-report",
        help="Write the run's page at the end: report.html in its folder.",
    ),
]
Flag = Annotated[bool, Parameter(negative=(), show_default=False)]
TrustCode = Annotated[
    Flag,
    Parameter(
        help="Run the Python files and programs that only the run folder or bundle "
        "names: planners and layouts, which may be a stranger's."
    ),
]
Rerun = Annotated[
    Flag, Parameter(help="Run the planners again too, and compare their commands.")
]
FreshSeed = Annotated[
    int | None,
    Parameter(
        converter=whole,
        validator=within("seed"),
        help="Also run the planners on unseen scenes of this seed.",
    ),
]
FreshScenes = Annotated[
    ScenesPerFamily | None,
    Parameter(help="Fresh scenes per family; as many as the run has if unsaid."),
]
Json = Annotated[Flag, Parameter(help="Print the result as JSON on stdout.")]
