"""Options in any words, on the command line and in files: refused, or they run."""

import contextlib
import io
import json
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

from beacon_mj import cli
from beacon_mj.episode.protocol import Protocol
from beacon_mj.eval.runs.overrides import flat
from beacon_mj.planners.registry import load_planner
from tests.fuzz.harness import Kind
from tests.fuzz.mutations import WILD, nudged

PLANNERS = ("push-through", "bug1", "bug2", "dstar-lite", "semantic", "beacon")
TEXTS = (
    *[str(value).encode(errors="replace").decode()[:200] for value in WILD],
    "1,2,3", "[1,2", "1;2", "(", "true", "-1", "1e-3", "0.25", "0.5", "all", "'x'",
)  # fmt: skip
#: Options whose every value here is no good.
INVALID = (
    ("--seed", ("-1", "1.5", "x", "99999999999999999999", "")),
    ("--scenes-per-family", ("0", "-3", "1e3", "10000000", "one")),
    ("--workers", ("0", "-1", "5000", "two")),
    ("--shard", ("0/2", "3/2", "1/0", "x", "1/9999999")),
    ("--perception", ("clear", "", "NOISY")),
    ("--log", ("some", "")),
    ("--protocol", ("easy", "", "paper,realistic")),
    ("--family", ("nowhere", "../sparse", "", "\x1b[2J")),
    ("--planner", ("beacn", "x.py:X", ":", "", "beacon:Beacon", "[red]")),
    ("--set", ("protocol.sensing_radius_m=-1", "beacon", "=", "beacon.x=1", "x.y=1")),
    ("--vary", ("beacon.push_bias=", "beacon.push_bias=1,1", "protocol.x=1,2")),
    ("--speed", ("1",)),
)


class Input(NamedTuple):
    """Words after `beacon-mj eval`, what `beacon.toml` says, and whether it is bad."""

    words: list[str]
    toml: str
    invalid: bool


def make(rng: Random) -> Input:
    words, toml, invalid = list[str](), "", rng.random() < 0.5
    for _ in range(rng.randint(0, 2)):
        words += ["--set", _setting(rng)]
    if invalid:  # Last, because of two values of a field the last one counts.
        option, values = rng.choice(INVALID)
        words += [option, rng.choice(values)]
    if rng.random() < 0.2:
        value = json.dumps(rng.choice([v for v in WILD if _plain(v)]))
        key = rng.choice(["seed", "workers", "log", "set", "planner", "nonsense"])
        toml = f"[eval]\n{key} = {value}\n"
    return Input(words, toml, invalid)


def _plain(value: Any) -> bool:
    """Whether TOML writes a value as JSON does."""
    numbers = isinstance(value, int | float) and abs(value) < 1e15
    return numbers or (isinstance(value, str) and value.isascii())


def _setting(rng: Random) -> str:
    """Return a setting of an existing field: its default, another value, or any."""
    target = rng.choice([*PLANNERS, "protocol"])
    config = Protocol() if target == "protocol" else load_planner(target)[1].Config()
    fields = flat(config)
    fields.pop("timestep_s", None)  # Small ones only take time.
    field = rng.choice([*fields] or ["x"])
    value = fields.get(field)
    text = rng.choice([str(value), str(nudged(value, rng)), rng.choice(TEXTS)])
    return f"{target}.{field}={text}"


def check(given: Input, folder: Path) -> bool:
    """Evaluate, and verify what was evaluated."""
    (folder / "beacon.toml").write_text(given.toml)
    named = [] if "--planner" in given.words else ["--planner", "push-through"]
    for name in PLANNERS:
        if any(word.startswith(f"{name}.") for word in given.words) and named:
            named += ["--planner", name]
    few = [] if "--scenes-per-family" in given.words else ["--scenes-per-family", "1"]
    family = [] if "--family" in given.words else ["--family", "sparse"]
    alone = [] if "--workers" in given.words else ["--workers", "1"]
    status = command(
        "eval", *named, *few, *family, *alone, *given.words, "--no-report",
        "--set", "protocol.max_steps=2", "--out", "run",
    )  # fmt: skip
    assert status in (0, cli.BAD_INPUT), status
    assert not (given.invalid and status == 0), given
    if status == 0:
        assert command("verify", "run", "--workers", "1") == 0
    return status == cli.BAD_INPUT


def command(*words: str) -> int:
    """Run a command; a refusal has to be one line, and nothing a traceback."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = cli.run(words)
    text = err.getvalue()
    assert "Traceback" not in text, text
    if status == cli.BAD_INPUT:
        assert text.startswith("error: "), text
        assert text.count("\n") == 1, text
        assert text.strip().isprintable(), text
    return status


CONFIGURATIONS = Kind("configurations", make, check)
test_configurations, test_configurations_long = (
    CONFIGURATIONS.short(),
    CONFIGURATIONS.long(),
)
