"""Finding planners, configuring them, and holding all of them to the contract."""

import pickle
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

from beacon_mj.episode.conformance import check_planner
from beacon_mj.errors import PlannerError, RunError
from beacon_mj.eval.runs.experiment import experiment
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.runs.overrides import configure, parse_settings
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.interface import Command, Observation, PlannerInfo
from beacon_mj.planners import registry
from beacon_mj.planners.base import Planner
from beacon_mj.planners.dstar_lite import DStarLitePlanner
from beacon_mj.planners.push_through import PushThrough, PushThroughConfig
from beacon_mj.planners.registry import load_planner, planner_names
from beacon_mj.planners.routes.graph import RoutePlanner
from tests.repository import REPOSITORY
from tests.worlds import cached_scene

HOSTILE = REPOSITORY / "tests" / "eval" / "hostile.py"
NAMES = sorted(registry.PAPER | registry.OURS | registry.REFERENCE)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("family", ["cluttered", "collision-required"])
def test_every_registered_planner_keeps_the_contract(name: str, family: str) -> None:
    found, cls = load_planner(name)
    assert found == name
    if issubclass(cls, RoutePlanner):  # It needs a scene with a route graph.
        family = {"cluttered": "lookalike-doors"}.get(family, "unweighed-doors")
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
    with pytest.raises(PlannerError, match="lacks act"):
        load_planner(f"{HOSTILE}:Unfinished")
    with pytest.raises(PlannerError, match="there is none"):
        load_planner("missing.py:Anything")


def test_a_file_that_cannot_be_imported(tmp_path: Path) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("def f(:\n")
    with pytest.raises(PlannerError, match=r"cannot be imported: SyntaxError"):
        load_planner(f"{broken}:Anything")


MINE = """\
from __future__ import annotations
from dataclasses import dataclass
import numpy as np
from beacon_mj import Command, Planner
{imports}
Speed = float
@dataclass(frozen=True, kw_only=True, slots=True)
class Settings:
    v: Speed = {speed}
class {name}(Planner):
    Config = Settings
    def reset(self, task): self.k = 0
    def act(self, observation):
        self.k += 1
        return Command(velocity_mps=np.array([self.config.v, 0.0]), give_up=self.k > 3)
"""


def write(folder: Path, name: str, speed: object, imports: str = "") -> str:
    folder.mkdir(exist_ok=True)
    path = folder / "mine.py"
    path.write_text(MINE.format(name=name, speed=speed, imports=imports))
    return f"{path}:{name}"


def test_two_files_of_one_stem(tmp_path: Path) -> None:
    """The case of names that stand in one file only: settings, pickling, identity."""
    specs = [write(tmp_path / n, f"Mine{n.upper()}", 0.1) for n in "ab"]
    entries, _ = planner_entries(specs, ["MineA.v=0.2", "MineB.v=0.3"])
    assert [e.config for e in entries] == [{"v": 0.2}, {"v": 0.3}]
    a, b = (load_planner(spec)[1] for spec in specs)
    assert a.__module__ != b.__module__
    for cls in (a, b):
        assert pickle.loads(pickle.dumps(cls)) is cls
        assert get_type_hints(cls.Config) == {"v": float}
    assert load_planner(specs[0])[1] is a


@pytest.mark.parametrize("workers", [1, 2])
def test_two_files_of_one_stem_run(tmp_path: Path, workers: int) -> None:
    specs = [write(tmp_path / n, f"Mine{n.upper()}", 0.1) for n in "ab"]
    entries, protocol = planner_entries(specs, ["MineA.v=0.2", "MineB.v=0.4"])
    config, refs = experiment(
        entries,
        protocol,
        families=["sparse"],
        scenes_per_family=2,
        seed=0,
        perception="noisy",
    )
    rows = [r for rs in run_jobs(config, plan(config, refs), None, workers) for r in rs]
    assert [r.outcome for r in rows] == ["gave_up"] * 4
    paths = {n: [r.path_length_m for r in rows if r.planner == n]
             for n in ("MineA", "MineB")}  # fmt: skip
    assert all(0.0 < a < b for a, b in zip(*paths.values(), strict=True))


def test_an_edited_file_is_loaded_anew(tmp_path: Path) -> None:
    first = load_planner(write(tmp_path, "Mine", 0.1))[1]
    again = load_planner(write(tmp_path, "Mine", 0.2))[1]
    assert (first.Config().v, again.Config().v) == (0.1, 0.2)
    assert pickle.loads(pickle.dumps(first)) is first


@pytest.mark.parametrize(
    "imports", ["from helper import SPEED", "from .helper import SPEED"]
)
def test_modules_beside_a_file_are_its_own(tmp_path: Path, imports: str) -> None:
    loaded = []
    for folder, speed in ((tmp_path / "a", 0.1), (tmp_path / "b", 0.2)):
        spec = write(folder, "Mine", "SPEED", imports)
        (folder / "helper.py").write_text("import other\nSPEED = other.SPEED\n")
        (folder / "other.py").write_text(f"import helper, random\nSPEED = {speed}\n")
        (folder / "random.py").write_text("raise RuntimeError\n")
        loaded.append(load_planner(spec)[1])
    assert [cls.Config().v for cls in loaded] == [0.1, 0.2]
    assert not {"helper", "other", "mine"} & set(sys.modules)
    for cls in loaded:
        home = cls.__module__.rpartition(".")[0]
        helper = sys.modules[f"{home}.helper"]
        assert helper.__spec__ is not None
        assert helper.__name__ == helper.__spec__.name == f"{home}.helper"


def test_a_file_that_was_mended_can_be_imported(tmp_path: Path) -> None:
    spec = write(tmp_path, "Mine", 0.1, "import helper")
    before = set(sys.modules)
    with pytest.raises(PlannerError, match="No module named 'helper'"):
        load_planner(spec)
    assert not {n for n in set(sys.modules) - before if "planner_" in n}
    (tmp_path / "helper.py").write_text("")
    assert load_planner(spec)[0] == "Mine"


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
        (
            {"speed_share": "fast"},
            "push-through.speed_share to be a finite number but it was 'fast'",
        ),
        (
            {"speed_share": "nan"},
            "push-through.speed_share to be a finite number but it was 'nan'",
        ),
        ({"speed_share": "1e999"}, "push-through.speed_share to be a finite number"),
        (
            {"speed_share": "2"},
            "Expected push-through.speed_share to be between 0.01 and 1 but it was 2.0",
        ),
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
