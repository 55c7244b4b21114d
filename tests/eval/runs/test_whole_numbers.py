"""Every whole number that a user can give has two bounds."""

import dataclasses
import inspect
import typing
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import msgspec
import pytest
from cyclopts.validators import Number

import beacon_mj
from beacon_mj.cli.app import COMMANDS, LOG_COMMANDS
from beacon_mj.constants import WHOLE_NUMBERS
from beacon_mj.errors import BeaconError, PlannerError
from beacon_mj.eval.runs.config import RunConfig
from beacon_mj.eval.runs.overrides import configure, flat
from beacon_mj.planners.registry import load_planner, planner_names
from beacon_mj.scene import Scene

BEYOND = (-(10**30), 10**30)


def annotated(hint: Any, metas: tuple[Any, ...] = ()) -> Iterator[tuple[Any, Any]]:
    """Yield the plain types of a type, each with all that is noted about it."""
    if typing.get_origin(hint) is Annotated:
        inner, *own = typing.get_args(hint)
        yield from annotated(inner, (*metas, *own))
    elif arguments := [a for a in typing.get_args(hint) if not isinstance(a, list)]:
        for each in arguments:
            yield from annotated(each, metas)
    else:
        yield hint, metas


def unbounded(hint: Any, seen: set[Any], path: str) -> Iterator[str]:
    """Yield where a struct, or what it holds, has a whole number without bounds."""
    for kind, metas in annotated(hint):
        limits = [m for m in metas if isinstance(m, msgspec.Meta)]
        bounded = any(m.ge is not None and m.le is not None for m in limits)
        if kind is int and not bounded:
            yield path
        fields = isinstance(kind, type) and typing.get_type_hints(
            kind, include_extras=True
        )
        if fields and kind not in seen and kind.__module__.startswith("beacon_mj"):
            seen.add(kind)
            for name, inner in fields.items():
                yield from unbounded(inner, seen, f"{path}.{name}")


@pytest.mark.parametrize("root", [RunConfig, Scene])
def test_what_is_read_from_files_is_bounded(root: type) -> None:
    seen = set[Any]()
    assert [*unbounded(root, seen, root.__name__)] == []
    assert len(seen) > 4


def test_an_unbounded_number_would_be_found() -> None:
    class Inner(msgspec.Struct):
        low: Annotated[int, msgspec.Meta(ge=0)]
        fine: Annotated[int, msgspec.Meta(ge=0, le=3)] | None

    Inner.__module__ = "beacon_mj.x"
    assert [*unbounded(tuple[Inner, ...] | None, set(), "x")] == ["x.low"]


@pytest.mark.parametrize("name", sorted(planner_names()))
def test_whole_numbers_of_planners_are_bounded(name: str) -> None:
    cls = load_planner(name)[1]
    for field, value in flat(cls.Config()).items():
        if type(value) is int:
            for beyond in BEYOND:
                with pytest.raises(PlannerError, match=f"Expected p.{field} to be"):
                    configure(cls, {field: str(beyond)}, "p")


COMMAND_LINE = [path for path, _ in (*COMMANDS.values(), *LOG_COMMANDS.values())]


@pytest.mark.parametrize("path", COMMAND_LINE)
def test_whole_numbers_of_commands_are_bounded(path: str) -> None:
    module, function = path.split(":")
    hints = typing.get_type_hints(
        getattr(import_module(module), function), include_extras=True
    )
    hints.pop("return", None)
    for name, hint in hints.items():
        for kind, metas in annotated(hint):
            if kind is int:
                validators = [v for m in metas for v in getattr(m, "validator", ())]
                bounds = [v for v in validators if isinstance(v, Number)]
                assert any(v.gte is not None and v.lte is not None for v in bounds), (
                    path, name,
                )  # fmt: skip


def calls(tmp: Path) -> dict[Callable[..., object], dict[str, object]]:
    return {
        beacon_mj.evaluate: {"planners": ["push-through"], "out": tmp / "run"},
        beacon_mj.generate_scenes: {"out": tmp / "scenes"},
        beacon_mj.certify: {"scene_dir": tmp},
        beacon_mj.regret: {"planner": "push-through"},
        beacon_mj.ablate: {"planner": "beacon", "out": tmp / "run"},
        beacon_mj.sweep: {"planner": "beacon", "out": tmp / "run"},
        beacon_mj.verify: {"target": tmp},
    }


def test_whole_numbers_of_calls_are_bounded(tmp_path: Path) -> None:
    tried = 0
    for call, arguments in calls(tmp_path).items():
        for name, parameter in inspect.signature(call).parameters.items():
            kinds = {kind for kind, _ in annotated(parameter.annotation)}
            if int not in kinds:
                continue
            for wrong in (*BEYOND, 1.5, True, "3"):
                flag = name.replace("_", "-")
                with pytest.raises(BeaconError, match=f"--{flag}: expected a whole nu"):
                    call(**arguments, **{name: wrong})
                tried += 1
    assert tried == 5 * 20
    assert not [*tmp_path.iterdir()]


def test_bounds_of_options_are_those_of_calls() -> None:
    for name in ("seed", "scenes_per_family", "workers"):
        low, high = WHOLE_NUMBERS[name]
        module = import_module("beacon_mj.cli.options")
        assert module.within(name) == Number(gte=low, lte=high)


def test_the_products_of_varied_values_are_bounded(tmp_path: Path) -> None:
    values = ",".join(str(0.01 * k) for k in range(1, 102))
    vary = [f"beacon.weights.{w}={values}" for w in ("w_t", "w_e", "w_d")]
    with pytest.raises(BeaconError, match="at most 10000 combinations of values but "):
        beacon_mj.evaluate(["beacon"], vary=vary, out=tmp_path / "run")


def test_configurations_are_dataclasses() -> None:
    """Else the walk over their fields would find nothing."""
    for name in planner_names():
        assert dataclasses.is_dataclass(load_planner(name)[1].Config)
