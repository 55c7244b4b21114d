"""Who runs: planners by name, file or class, with their settings and their variants."""

import dataclasses
import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, cast

import msgspec

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import PlannerError, RunError, unknown
from beacon_mj.eval.runs.code_record import as_it_is, code_of, home_of
from beacon_mj.eval.runs.config import PlannerEntry
from beacon_mj.eval.runs.overrides import Settings, built_ins, parse_settings
from beacon_mj.eval.runs.variants import (
    BRACKETS,
    PROTOCOL,
    Values,
    VaryValues,
    axes,
    canonical,
    checked_name,
    configuration,
    text_of,
    texts_of,
    variants,
    with_protocol,
)
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle
from beacon_mj.planners.program import is_program, program_name
from beacon_mj.planners.registry import (
    ALIASES,
    PAPER,
    file_planner,
    load_planner,
    planner_names,
)

#: A planner: its name, `file.py:Class`, `exec:COMMAND`, or its class; or a pair of that
#: and either an instance of its `Config` or a mapping of values.
PlannerChoice = str | type[Planner] | tuple[str | type[Planner], object]
CACHE = "__msgspec_cache__"  #: What msgspec leaves in a dataclass that it converts.
PYTHON = "python:"  #: Begins the spec of a class that was handed over in Python.


class Handed(NamedTuple):
    """A planner that was handed over as an object, which no worker could load.

    Attributes:
        cls: Its class.
        config: The instance of its `Config`; None for that of the entry's settings.
    """

    cls: type[Planner]
    config: Any = None


class Lineup(NamedTuple):
    """The planners of a run.

    Attributes:
        entries: All of them, as the run's configuration holds them.
        protocol: How episodes are run, unless an entry has a protocol of its own.
        handed: Those that were given as Python objects, by name.
    """

    entries: tuple[PlannerEntry, ...]
    protocol: Protocol
    handed: dict[str, Handed]


@dataclasses.dataclass(frozen=True, slots=True)
class _Loaded:
    """A planner before anything is set in it.

    Without a class it is isolated: imported in a process of its own, and not here.
    """

    name: str
    spec: str
    cls: type[Planner] | None
    config: Any = None
    values: Mapping[str, str] | None = None


def planner_entries(
    specs: Sequence[str], settings: Sequence[str], isolate: bool | None = None
) -> tuple[tuple[PlannerEntry, ...], Protocol]:
    """Return the planners and the protocol that texts ask for; see `line_up`."""
    found = line_up(specs, settings, isolate=isolate)
    return found.entries, found.protocol


def line_up(
    planners: Sequence[PlannerChoice] | Mapping[str, PlannerChoice],
    settings: Values = (),
    vary: VaryValues = (),
    protocol: Protocol | None = None,
    isolate: bool | None = None,
) -> Lineup:
    """Return the planners and the protocol that the user asked for.

    Args:
        planners: Names, `all`, `file.py:Class`, or classes; a pair of one of them and
            its configuration; or a mapping that gives them names.
        settings: `planner.field=value` or `protocol.field=value`.
        vary: `planner.field=a,b,c` or `protocol.field=a,b,c`: a planner runs with
            every combination of its own values and the protocol's.
        protocol: What the settings of `protocol` change; the default one if None.
        isolate: Whether planners run in processes of their own; if None, those from
            files do, unless they come with an instance of their `Config`.

    Raises:
        PlannerError: If a planner, a field or a value is no good, or one that is to be
            isolated cannot be.
        RunError: If two planners have one name, or a setting names none of them.
    """
    loaded = dict[str, _Loaded]()
    for each in _loaded(planners, isolate):
        if each.name in loaded or each.name == PROTOCOL:
            raise RunError(
                f"Expected planners to have names of their own but {each.name!r} "
                "repeats."
            )
        loaded[each.name] = each
    targets = [PROTOCOL, *loaded]
    parsed = parse_settings([canonical(s) for s in texts_of(settings)], targets)
    base = with_protocol(protocol or Protocol(), parsed.get(PROTOCOL, {}))
    varied = axes(vary, targets)
    entries: list[PlannerEntry] = []
    for each in loaded.values():
        entry = _entry(each, parsed, base)
        own = {f: v for (t, f), v in varied.items() if t == each.name}
        if own and each.config is not None:
            raise _configured(each.name, "vary")
        shared = {f"protocol.{f}": v for (t, f), v in varied.items() if t == PROTOCOL}
        entries += map(as_it_is, variants(entry, each.cls, own | shared, base))
    handed = {
        entry.name: Handed(each.cls, each.config)
        for entry in entries
        for each in [loaded[entry.base]]
        if each.cls and (each.config is not None or each.spec.startswith(PYTHON))
    }
    for found in handed.values():
        _make_portable(found.cls.Config)
    return Lineup(tuple(entries), base, handed)


def _loaded(
    planners: Sequence[PlannerChoice] | Mapping[str, PlannerChoice],
    isolate: bool | None,
) -> Iterator[_Loaded]:
    """Yield the planners that are chosen; the same one twice is one."""
    if isinstance(planners, Mapping):
        for name, choice in planners.items():
            found = _load(choice, isolate)
            yield dataclasses.replace(found, name=checked_name(name, BRACKETS))
        return
    chosen: list[PlannerChoice] = []
    for choice in _listed(planners):
        if choice == "all":
            chosen += PAPER
        elif isinstance(choice, str):
            chosen.append(ALIASES.get(choice, choice))
        else:
            chosen.append(choice)
    texts = set[str]()
    for choice in chosen:
        if not (isinstance(choice, str) and choice in texts):
            yield _load(choice, isolate)
        if isinstance(choice, str):
            texts.add(choice)


def _listed(planners: Any) -> Sequence[PlannerChoice]:
    """Return a list of planners, also where somebody gave a single one."""
    if isinstance(planners, str | type):
        return [cast(PlannerChoice, planners)]
    if isinstance(planners, tuple) and len(planners) == 2:
        second = planners[1]
        if not (isinstance(second, str | tuple) or inspect.isclass(second)):
            return [planners]
    return [*planners]


def _load(choice: PlannerChoice, isolate: bool | None) -> _Loaded:
    if not isinstance(choice, tuple):
        return _named(choice, isolate)
    who, values = choice
    if isinstance(values, Mapping):
        texts = {str(f): text_of(value) for f, value in values.items()}
        return dataclasses.replace(_named(who, isolate), values=texts)
    found = _named(who, bool(isolate))
    if found.cls is None:
        raise PlannerError(
            f"{found.name}: expected a mapping of fields, for a planner in a process "
            f"of its own, but it was {type(values).__name__}."
        )
    if not isinstance(values, found.cls.Config):
        raise PlannerError(
            f"{found.name}: expected an instance of {found.cls.Config.__qualname__} or "
            f"a mapping of its fields but it was {type(values).__name__}."
        )
    return dataclasses.replace(found, config=values)


def _named(choice: object, isolate: bool | None) -> _Loaded:
    """Return a planner that is given by its name, its file or its class."""
    if isinstance(choice, str):
        return _by_spec(ALIASES.get(choice, choice), isolate)
    if not (inspect.isclass(choice) and issubclass(choice, Planner)):
        raise PlannerError(
            f"Expected a planner's name or a subclass of Planner but it was {choice!r}."
        )
    if missing := sorted(choice.__abstractmethods__):
        raise PlannerError(
            f"{choice.__qualname__}: expected a planner with reset() and act() but it "
            f"lacks {', '.join(missing)}."
        )
    home = f"{choice.__module__}:{choice.__qualname__}"
    for name, known in planner_names().items():
        if known == home:
            return _Loaded(name, name, None if isolate else choice)
    if isolate:
        raise PlannerError(
            f"{choice.__qualname__}: expected a name or file.py:Class, to run "
            "it in a process of its own, but it was a class."
        )
    return _Loaded(choice.__name__, PYTHON + home, choice)


def _by_spec(spec: str, isolate: bool | None) -> _Loaded:
    """Return a planner that is given as text; an isolated one is not imported."""
    if is_program(spec):
        return _Loaded(checked_name(program_name(spec)), spec, None)
    member = file_planner(spec)
    if isolate is None:
        isolate = member is not None
    if not isolate:
        name, cls = load_planner(spec)
        return _Loaded(checked_name(name), spec, cls)
    if member is None and spec not in planner_names():
        raise PlannerError(unknown("planner", spec, [*planner_names(), *ALIASES]))
    return _Loaded(checked_name(member or spec), spec, None)


def _configured(name: str, option: str) -> RunError:
    return RunError(
        f"--{option} {name}: expected none for a planner with a Config instance; give "
        "its values as a mapping instead."
    )


def _entry(each: _Loaded, parsed: Settings, protocol: Protocol) -> PlannerEntry:
    """Return a planner with what is set in it."""
    own = {**(each.values or {}), **parsed.get(each.name, {})}
    if own and each.config is not None:
        raise _configured(each.name, "set")
    entry = PlannerEntry(
        name=each.name,
        spec=each.spec,
        settings=own,
        config={} if each.config is None else built_ins(each.config),
        isolated=each.cls is None,
        oracle=each.cls is not None and issubclass(each.cls, Oracle),
        bit_reproducible=each.cls is None or each.cls.bit_reproducible is True,
        code=code_of(each.spec, each.cls),
        home=home_of(each.spec),
    )
    if each.config is not None:
        return entry
    said = configuration(entry, own, protocol, each.cls)
    return msgspec.structs.replace(
        entry, config=said.config, bit_reproducible=said.bit_reproducible
    )


def _make_portable(config: type[Any]) -> None:
    """Take msgspec's cache off a configuration class, which could not be sent on.

    A class of a script or a notebook goes to a worker with all its attributes.
    """
    for cls in config.__mro__:
        if CACHE in vars(cls):
            delattr(cls, CACHE)
    for each in getattr(config, "__dataclass_fields__", {}).values():
        for nested in (type(each.default), each.default_factory):
            if isinstance(nested, type) and dataclasses.is_dataclass(nested):
                _make_portable(nested)
