"""Write the pages of docs/reference from the code that they describe.

Usage: python .ci/reference.py
"""

import dataclasses
import importlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import get_type_hints

from reference_exec import exec_schema
from reference_python import entry, fields, meanings, table

import beacon_mj
from beacon_mj.cli.app import app
from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.eval.api.planners import describe_planner, field_comments, settable
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs import isolation
from beacon_mj.eval.runs.overrides import flat
from beacon_mj.eval.runs.text_values import describe
from beacon_mj.planners.registry import OURS, PAPER, REFERENCE
from beacon_mj.recording.schemas import BEACON, TOPICS
from beacon_mj.rl.observer import Observer
from beacon_mj.rl.options import Options
from beacon_mj.rl.rewards import TERMS

FOLDER = Path(__file__).parent.parent / "docs" / "reference"
API = FOLDER.parent / "planner-api.md"
GYM = FOLDER.parent / "gym.md"
SCHEMA = "exec-v1.schema.json"  #: Stands in the documentation, and in the package.
#: What a planner meets: its tables stand in that page.
INTERFACE = {
    "beacon_mj.interface": (
        "Task",
        "SensorSheet",
        "Observation",
        "SensedObstacle",
        "Contact",
        "PushEvidence",
        "Scan",
        "Command",
        "PlannerInfo",
    ),
    "beacon_mj.geometry": ("Footprint", "Footprints"),
    "beacon_mj.planners.base": ("Planner",),
}
MADE = "<!-- Written by .ci/reference.py from the code: do not edit. -->\n\n"
#: Where public names live, in the order of the page, and what it calls that.
ROOMS = {
    "beacon_mj.eval": "Evaluation",
    "beacon_mj.planners": "Planners",
    "beacon_mj.episode": "Episodes",
    "beacon_mj.rl": "Learners",
    "beacon_mj.scene": "Scenes",
    "beacon_mj.world": "World",
    "beacon_mj.recording": "Logs",
    "beacon_mj.rendering": "Pictures",
    "beacon_mj.fidelity": "Physics",
    "beacon_mj": "Other",
}


def commands() -> str:
    """Return every command with its options, as `--help` has them."""
    text = app.generate_docs(output_format="markdown")
    text = text.replace("# beacon-mj\n", "# Commands\n", 1)
    text = re.sub(r"## Table of Contents.*?(?=\*\*Commands)", "", text, flags=re.S)
    return text.replace("```console\n", "```text\n").rstrip() + "\n"


def parameters() -> str:
    """Return every parameter of every planner, and those of the protocol."""
    parts = [
        "# Parameters\n\n`--set planner.field=value` changes one; "
        "[Planners](../planners.md#setting-parameters) says how values are written.\n\n"
    ]
    for name in [*PAPER, *OURS, *REFERENCE]:
        own = describe_planner(name).fields
        rows = ((f"`{f.name}`", f"`{settable(f.default)}`", f.meaning) for f in own)
        parts += [f"## `{name}`\n\n", table(("field", "default", "what it is"), rows)]
    parts += ["## The protocol\n\n`--set protocol.field=value`.\n\n", protocol()]
    return "".join(parts)


def protocol() -> str:
    """Return the fields of the protocol, whose docstring says what they are."""
    notes = meanings(beacon_mj.Protocol)
    hints = get_type_hints(beacon_mj.Protocol, include_extras=True)
    rows = (
        (f"`{name}`", f"`{settable(value)}`", describe(hints[name]), notes[name])
        for name, value in flat(beacon_mj.Protocol()).items()
    )
    return table(("field", "default", "value", "what it is"), rows)


def columns() -> str:
    """Return every column of the rows, in order."""
    notes, hints = field_comments(Row), get_type_hints(Row, include_extras=True)
    wall = ", ".join(f"`{name}`" for name in sorted(WALL_CLOCK_COLUMNS))
    rows = ((f"`{n}`", f"{notes[n]} *{describe(hints[n])}*") for n in notes)
    return (
        "# Columns\n\nOf `episodes.parquet` and `episodes.jsonl`, in their order; "
        "[Metrics](../metrics.md) has the symbols, and what else to know. Only "
        f"{wall} differ between two runs of one configuration.\n\n"
        + table(("column", "definition, *type*"), rows)
    )


def topics() -> str:
    """Return the topics of a log, and the fields of our own messages."""
    rows = ((f"`{topic}`", f"`{schema}`") for topic, schema in TOPICS.items())
    parts = [
        "# Topics\n\nWhat a log holds. [Logs](../logs.md#topics) says when each "
        "message is written and what it means.\n\n",
        table(("topic", "message"), rows),
    ]
    for name, text in BEACON.items():
        found = (field.partition(":") for field in text.split())
        rows3 = ((f"`{field}`", *field_type(kind)) for field, _, kind in found)
        head = ("field", "type", "how many")
        parts += [f"## `beacon_mj.{name}`\n\n", table(head, rows3)]
    return "".join(parts)


def field_type(kind: str) -> tuple[str, str]:
    """Return type and count of a field; `schemas.py` says what the marks mean."""
    marks = {"*": "any number", "?": "one or none"}
    return f"`{kind.lstrip('*?')}`", marks.get(kind[0], "one")


def python() -> str:
    """Return every public name: how it is called, and what its docstring says."""
    parts = [
        "# Python API\n\nAll of `beacon_mj.__all__`. [In Python](../python.md) shows "
        "how the calls go together.\n\n"
    ]
    told = {name for names in INTERFACE.values() for name in names}
    left = set(beacon_mj.__all__) - {"__version__"} - told
    for room, title in ROOMS.items():
        own = sorted((n for n in left if home(n).startswith(room)), key=str.lower)
        parts += [
            f"## {title}\n\n",
            *(entry(name, getattr(beacon_mj, name)) for name in own),
        ]
        left -= set(own)
    return "".join(parts)


def home(name: str) -> str:
    """Return the module of a public name."""
    return str(getattr(beacon_mj, name).__module__)


def interface(text: str) -> str:
    """Return the page of the planner interface with its tables made anew."""
    for module, names in INTERFACE.items():
        for name in names:
            cls = getattr(importlib.import_module(module), name)
            text = filled(text, name, fields(cls))
    return text


def filled(text: str, name: str, made: str) -> str:
    """Return a page with what stands in one of its places made anew."""
    pattern = rf"(<!-- {name}: .ci/reference.py -->\n).*?(?=<!-- end -->)"
    text, found = re.subn(
        pattern, lambda m: f"{m[1]}\n{made.rstrip()}\n\n", text, flags=re.S
    )
    if found != 1:
        raise SystemExit(f"Expected one place for {name} in a page: {found}")
    return text


def environments(text: str) -> str:
    """Return the page of the environments with its tables made anew."""
    notes = meanings(Options)
    options = (
        (f"`{f.name}`", option(f), notes[f.name])
        for f in dataclasses.fields(Options)
        if f.name != "family"
    )
    rewards = ((f"`{n}`", f"{t.weight:g}", t.meaning) for n, t in TERMS.items())
    text = filled(text, "options", table(("option", "default", "what it is"), options))
    head = ("term", "weight", "what it weighs")
    return filled(
        filled(text, "rewards", table(head, rewards)), "observation", observation()
    )


def option(field: "dataclasses.Field[object]") -> str:
    """Return the default of an option."""
    if field.default is dataclasses.MISSING:
        return "none changed"
    return "none" if field.default is None else f"`{field.default}`"


def observation() -> str:
    """Return the columns of every part of an observation."""
    shapes = {"scan": "(beams,), with a lidar"}
    rows = (
        (
            f"`{part.name}` {shapes.get(part.name, part.shape)}",
            f"`{c.name}`",
            f"{c.low:g} to {c.high:g}",
            c[3],
        )
        for part in Observer(beams=1).parts
        for c in part.columns
    )
    return table(("part and shape", "column", "bounds", "what it is"), rows)


PAGES: dict[str, Callable[[], str]] = {
    "commands.md": commands,
    "parameters.md": parameters,
    "columns.md": columns,
    "topics.md": topics,
    "python.md": python,
}


def pages() -> dict[Path, str]:
    """Return every page that is written here as it should be."""
    made = {
        FOLDER / name: MADE + write().rstrip() + "\n" for name, write in PAGES.items()
    }
    places = (FOLDER, Path(str(isolation.__file__)).parent)
    schema = dict.fromkeys((place / SCHEMA for place in places), exec_schema())
    return (
        made
        | schema
        | {
            API: interface(API.read_text()),
            GYM: environments(GYM.read_text()),
        }
    )


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for path, text in pages().items():
        path.write_text(text)
        print(path)
