"""Settings laid over configurations that hold others."""

import dataclasses
from dataclasses import dataclass
from typing import Literal

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import PlannerError, RunError
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.runs.overrides import (
    built_ins,
    configure,
    convert,
    dotted,
    flat,
    parse_settings,
)
from beacon_mj.eval.runs.variants import text_of
from beacon_mj.planners.base import NoConfig, Planner
from beacon_mj.planners.beacon import Beacon, BeaconConfig
from beacon_mj.planners.beacon_voi import BeaconVoi
from beacon_mj.planners.bug1 import Bug1
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.objective import Weights
from beacon_mj.planners.registry import load_planner, planner_names
from beacon_mj.planners.semantic import Semantic

CONFIGS = [load_planner(name)[1].Config for name in sorted(planner_names())]


@dataclass(frozen=True, kw_only=True, slots=True)
class Inner:
    low: float = 1.0
    high: float = 2.0
    sharing: frozenset[Literal["kind", "scale"]] = frozenset()

    def __post_init__(self) -> None:
        expect_between("low", self.low, 0.0, self.high)


@dataclass(frozen=True, kw_only=True, slots=True)
class Outer:
    #: Other than the default of its type.
    inner: Inner = Inner(high=9.0)
    count: int = 3
    name: str | None = None


def test_inner_defaults_of_the_outer_stay() -> None:
    found = convert(Outer, {"inner.sharing": "[kind,scale]"}, "x", PlannerError)
    assert found.inner == Inner(high=9.0, sharing=frozenset({"kind", "scale"}))
    voi = configure(BeaconVoi, {"belief.replan_on_belief": "false"}, "beacon-voi")
    assert voi.belief.threshold == 0.0


def test_fields_that_bound_each_other_are_set_together() -> None:
    found = convert(Outer, {"inner.low": "20", "inner.high": "30"}, "x", PlannerError)
    assert (found.inner.low, found.inner.high) == (20.0, 30.0)
    moved = {
        "belief.likelihoods.moved": "0.1,0.9,0.7",
        "belief.likelihoods.not_moved": "0.895,0.095,0.1",
    }
    assert configure(Beacon, moved, "beacon").belief.likelihoods.moved[0] == 0.1


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"inner.low": "10"}, r"Expected x\.inner\.low to be between 0 and 9 but it"),
        ({"inner.low": "[1]"}, r"Expected x\.inner\.low to be a finite number but it"),
        ({"inner.lo": "1"}, r"field of x 'inner\.lo'\. Did you mean 'inner\.low'\?"),
        ({"sharing": ""}, r"Did you mean 'inner\.sharing'\? Available: count, inner\."),
        ({"inner": "1"}, r"Unknown field of x 'inner'"),
        ({"count.low": "1"}, r"Unknown field of x 'count\.low'"),
        ({"inner.sharing": "[a]"}, r"each one of kind, scale but it was '\[a\]'"),
    ],
)
def test_errors_name_the_dotted_field(values: dict[str, str], message: str) -> None:
    with pytest.raises(PlannerError, match=message):
        convert(Outer, values, "x", PlannerError)


@pytest.mark.parametrize(
    ("cls", "field", "text", "expected"),
    [
        (Beacon, "weights.w_t", "-1", "finite and >= 0"),
        (Beacon, "risk", "0.5,-1,0.5", "3 numbers between 0 and 1000"),
        (Beacon, "push.speed_mps", "0", "between 0.01 and 5"),
        (Beacon, "belief.threshold", "3", "between 0 and 2"),
        (Beacon, "belief.likelihoods.moved", "0.1,0.9,0.75", "sum to one"),
        (Beacon, "belief.likelihoods.moved", "0,0.9,0.75", "positive"),
        (Beacon, "belief.likelihoods.broken", "2,0,0", "3 numbers between 0 and 1"),
        (Semantic, "class_cost", "0.8,-0.2,1", "3 numbers between 0 and 1000"),
        (BeaconVoi, "least_chance", "0", "between 0.001 and 1"),
        (Bug1, "turn", "up", "one of left, right"),
    ],
)
def test_ranges_are_named_with_the_whole_path(
    cls: type[Planner], field: str, text: str, expected: str
) -> None:
    with pytest.raises(PlannerError) as caught:
        configure(cls, {field: text}, "p")
    assert f"Expected p.{field} to be " in str(caught.value)
    assert expected in str(caught.value)


def wrong(config: type) -> list[tuple[str, str]]:
    """Values far out of range for every number that a configuration holds."""
    found: list[tuple[str, str]] = []
    for field, value in flat(config()).items():
        many = isinstance(value, tuple)
        number = value[0] if many else value
        if isinstance(number, bool) or not isinstance(number, float | int):
            continue
        for bad in (-1e9, 1e9):
            text = f"{bad:.0f}"
            found.append((field, ",".join([text] * 3) if many else text))
    return found


@pytest.mark.parametrize("config", CONFIGS, ids=lambda c: c.__name__)
def test_every_number_of_every_planner_has_a_range(config: type) -> None:
    """Weights are the exception: they have no upper bound."""
    for field, text in wrong(config):
        if text.startswith("-") or not field.startswith("weights."):
            with pytest.raises(PlannerError, match=f"Expected p.{field} to be"):
                convert(config, {field: text}, "p", PlannerError)


@pytest.mark.parametrize("config", [*CONFIGS, Protocol, Outer])
def test_every_value_can_be_set_to_what_it_is(config: type) -> None:
    default = config()
    for field, value in flat(default).items():
        text = str(sorted(value)) if isinstance(value, frozenset) else str(value)
        assert convert(config, {field: text}, "p", PlannerError) == default


@given(st.floats(0.0, 1e6), st.floats(0.0, 1000.0))
def test_what_is_set_is_what_is_built(w_t: float, bias: float) -> None:
    values = {"weights.w_t": str(w_t), "push_bias": str(bias)}
    assert configure(Beacon, values, "beacon") == BeaconConfig(
        weights=Weights(w_t=w_t), push_bias=bias
    )


def test_targets_end_before_their_field() -> None:
    texts = ["beacon.weights.w_t=0.5", "a.b.c.d=1", "a.x=y=z"]
    parsed = parse_settings(texts, ["beacon", "a", "a.b"])
    assert parsed["beacon"] == {"weights.w_t": "0.5"}
    assert parsed["a.b"] == {"c.d": "1"}
    assert parsed["a"] == {"x": "y=z"}


def test_a_run_records_what_was_set_inside() -> None:
    (entry,), _ = planner_entries(
        ["beacon"], ["beacon.weights.w_t=0.5", "beacon.risk=[1,0,2]"]
    )
    assert entry.settings == {"weights.w_t": "0.5", "risk": "[1,0,2]"}
    assert entry.config["weights"]["w_t"] == 0.5
    assert tuple(entry.config["risk"]) == (1.0, 0.0, 2.0)


def test_a_planner_without_parameters_has_none_to_set() -> None:
    assert convert(NoConfig, {}, "p", PlannerError) == NoConfig()
    with pytest.raises(PlannerError, match="Available: none"):
        convert(NoConfig, {"x": "1"}, "p", PlannerError)


def test_the_protocol_is_checked_however_it_is_made() -> None:
    with pytest.raises(RunError, match=r"Expected protocol\.max_steps to be"):
        convert(Protocol, {"max_steps": "0"}, "protocol", RunError)
    with pytest.raises(RunError, match=r"protocol\.max_steps to be int >= 1 but"):
        Protocol(max_steps=0)
    with pytest.raises(RunError, match=r"protocol\.pose_noise_m to be .* it was nan"):
        Protocol(pose_noise_m=float("nan"))


@pytest.mark.parametrize("config", CONFIGS, ids=lambda c: c.__name__)
def test_a_recorded_configuration_has_the_same_dotted_names(config: type) -> None:
    assert dotted(msgspec.to_builtins(config())) == msgspec.to_builtins(flat(config()))


def test_the_flat_view_has_every_leaf() -> None:
    names = flat(BeaconConfig())
    assert {"risk", "weights.w_e", "belief.likelihoods.broken"} <= set(names)
    assert all(not dataclasses.is_dataclass(value) for value in names.values())


@pytest.mark.parametrize("former", ["belief.update_belief", "update_belief"])
def test_a_former_name_is_refused_with_the_new_one(former: str) -> None:
    new = f"beacon.{former} is now beacon.belief.memory=belief, failures or none"
    with pytest.raises(PlannerError, match=new):
        configure(Beacon, {former: "false"}, "beacon")


def test_a_set_of_words_is_recorded_in_one_order() -> None:
    text = {"belief.sharing": "[scale,kind]", "belief.memory": "belief"}
    config = configure(Beacon, text, "beacon")
    assert config.belief.sharing == {"kind", "scale"}
    assert built_ins(config)["belief"]["sharing"] == ["kind", "scale"]
    assert configure(BeaconVoi, {"belief.sharing": "[]"}, "v").belief.sharing == set()
    assert text_of(config.belief.sharing) == "kind,scale"
    with pytest.raises(PlannerError, match="each one of kind, scale"):
        configure(Beacon, {"belief.sharing": "[kinds]"}, "beacon")
