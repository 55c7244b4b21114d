"""Finding planners, configuring them, and holding all of them to the contract."""

from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from beacon_mj.episode.conformance import check_planner
from beacon_mj.errors import PlannerError, RunError
from beacon_mj.eval.runs.config import planner_entries
from beacon_mj.eval.runs.overrides import configure, parse_settings
from beacon_mj.interface import Command, Observation, PlannerInfo
from beacon_mj.planners import registry
from beacon_mj.planners.base import Planner
from beacon_mj.planners.dstar_lite import DStarLitePlanner
from beacon_mj.planners.push_through import PushThrough, PushThroughConfig
from beacon_mj.planners.registry import load_planner, planner_names
from tests.repository import REPOSITORY
from tests.worlds import cached_scene

HOSTILE = REPOSITORY / "tests" / "eval" / "hostile.py"
NAMES = sorted(registry.PAPER | registry.REFERENCE)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("family", ["cluttered", "collision-required"])
def test_every_registered_planner_keeps_the_contract(name: str, family: str) -> None:
    found, cls = load_planner(name)
    assert found == name
    check_planner(cls, cached_scene(family, 0), steps=60)


def test_aliases_and_unknown_names() -> None:
    assert load_planner("bug") == load_planner("bug1")
    with pytest.raises(PlannerError, match=r"'dstar-lit'\. Did you mean 'dstar-lite'"):
        load_planner("dstar-lit")


def test_a_planner_from_a_file() -> None:
    name, cls = load_planner(f"{HOSTILE}:Harmless")
    assert name == "Harmless"
    assert issubclass(cls, Planner)
    with pytest.raises(PlannerError, match=r"'Harmles'\. Did you mean 'Harmless'"):
        load_planner(f"{HOSTILE}:Harmles")
    with pytest.raises(PlannerError, match="lacks act, Config"):
        load_planner(f"{HOSTILE}:Unfinished")
    with pytest.raises(PlannerError, match="there is none"):
        load_planner("missing.py:Anything")


def test_a_file_that_cannot_be_imported(tmp_path: Path) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("def f(:\n")
    with pytest.raises(PlannerError, match=r"cannot be imported: SyntaxError"):
        load_planner(f"{broken}:Anything")


def test_entry_points_join_but_do_not_replace(monkeypatch: pytest.MonkeyPatch) -> None:
    home = "beacon_mj.planners.push_through:PushThrough"
    found = [
        EntryPoint("mine", home, registry.GROUP),
        EntryPoint("beacon", home, registry.GROUP),
    ]
    monkeypatch.setattr(registry, "entry_points", lambda group: found)
    assert load_planner("mine") == ("mine", PushThrough)
    assert planner_names()["beacon"] == registry.PAPER["beacon"]


def test_settings_are_typed_by_their_field() -> None:
    built = configure(PushThrough, {"speed_share": "0.5"}, "push-through")
    assert built == PushThroughConfig(speed_share=0.5)
    assert configure(DStarLitePlanner, {}, "dstar-lite") == DStarLitePlanner.Config()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"speed": "1"}, r"field of push-through 'speed'\. Did you mean 'speed_share'"),
        ({"speed_share": "fast"}, "speed_share: expected float but it was 'fast'"),
        ({"speed_share": "nan"}, "push-through.speed_share to be finite"),
        ({"speed_share": "1e999"}, "speed_share: Number out of range"),
        ({"speed_share": "2"}, "Expected speed_share to be between 0.01 and 1"),
    ],
)
def test_bad_settings_are_named(values: dict[str, str], message: str) -> None:
    with pytest.raises(PlannerError, match=message):
        configure(PushThrough, values, "push-through")


def test_setting_texts() -> None:
    parsed = parse_settings(["p.a=1", "p.b = x=y", "p.a=2", "q.c="], ["p", "q"])
    assert parsed == {"p": {"a": "2", "b": "x=y"}, "q": {"c": ""}}
    for text in ("a=1", "p.a", ".a=1", "p.=1"):
        with pytest.raises(RunError, match=r"expected TARGET\.FIELD=VALUE"):
            parse_settings([text], ["p"])
    with pytest.raises(RunError, match=r"target 'pp'\. Did you mean 'p'"):
        parse_settings(["pp.a=1"], ["p"])


def test_entries_hold_every_value_of_the_configuration() -> None:
    entries, protocol = planner_entries(
        ["bug", "bug1", "push-through"],
        ["push-through.speed_share=0.5", "protocol.max_steps=7"],
    )
    assert [e.name for e in entries] == ["bug1", "push-through"]
    assert entries[1].config == {"speed_share": 0.5}
    assert protocol.max_steps == 7
    assert [e.name for e in planner_entries(["all"], [])[0]] == [*registry.PAPER]
    with pytest.raises(RunError, match="'Harmless' repeats"):
        planner_entries([f"{HOSTILE}:Harmless", f"/{HOSTILE}:Harmless"], [])


class Spoiler(PushThrough):
    def act(self, observation: Observation) -> Command:
        observation.footprints.vertices[:] += 1.0
        return super().act(observation)


class Fickle(PushThrough):
    def act(self, observation: Observation) -> Command:
        return Command(velocity_mps=np.random.default_rng().normal(size=2))


class Fabulist(PushThrough):
    def act(self, observation: Observation) -> Command:
        beliefs: Any = {"obstacle_99": (0.2, 0.3, 0.5)}
        return Command(velocity_mps=np.zeros(2), info=PlannerInfo(beliefs=beliefs))


class Unsure(PushThrough):
    def act(self, observation: Observation) -> Command:
        beliefs: Any = {o.id: (0.5, 0.5, 0.5) for o in observation.obstacles}
        return Command(velocity_mps=np.zeros(2), info=PlannerInfo(beliefs=beliefs))


class Mute(PushThrough):
    def act(self, observation: Observation) -> Command:
        return None  # type: ignore[return-value]


class Warm(PushThrough):
    Config = dict  # type: ignore[assignment]


@pytest.mark.parametrize(
    ("cls", "message"),
    [
        (Spoiler, "read-only"),
        (Fickle, "same commands .* differ in step 0"),
        (Fabulist, "'obstacle_99' was not sensed"),
        (Unsure, "three probabilities that sum to 1"),
        (Mute, "to return a Command but it was NoneType"),
        (Warm, "Config to be a dataclass"),
    ],
)
def test_a_broken_contract_is_named(cls: type[Planner], message: str) -> None:
    with pytest.raises(PlannerError, match=message):
        check_planner(cls, cached_scene("cluttered", 0), steps=30)
