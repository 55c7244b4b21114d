"""What a planner returns, converted once and checked once.

Only the value that comes out of here is applied, logged and measured.
"""

import reprlib
from collections.abc import Mapping, Sized
from operator import is_
from types import MappingProxyType
from typing import Any, get_args

import numpy as np

from beacon_mj.errors import DETAIL_CHARS, one_line
from beacon_mj.geometry import Array
from beacon_mj.interface import Action, Command, Drive, PlannerInfo, Probabilities

ACTIONS: tuple[str, ...] = get_args(Action)
SPEED_MAX_MPS = 1e6  #: No velocity is larger; the robot's limit applies below it.
COORDINATE_MAX_M = 1e6  #: No point of a path is further out.
PATH_POINTS = 10_000  #: Most points of a path.
TERMS = 100  #: Most terms of an objective.
NAME_CHARS = 100  #: Longest name of a term.
COUNT_MAX = 2**53  #: Largest number of expansions.
_SHORT = reprlib.Repr()  #: Of a list of a million numbers, or a text of megabytes.
_SHORT.maxother = _SHORT.maxstring = _SHORT.maxlong = 300
_SHORT.maxlist = _SHORT.maxtuple = _SHORT.maxdict = _SHORT.maxset = 50


class PlannerFailure(Exception):
    """A planner raised, or returned something that is no command; one line says what.

    `raised` is whether it raised; `where` is `file:line` of the planner's code, as far
    as whoever runs it can tell.
    """

    def __init__(self, text: str, *, raised: bool = False, where: str = "") -> None:
        """Keep the texts as one line each."""
        super().__init__(one_line(text))
        self.raised = raised
        self.where = one_line(where)


def checked_command(
    answer: object,
    sensed: Mapping[str, object],
    beliefs: Mapping[str, Probabilities] = MappingProxyType({}),
    drive: Drive = "holonomic",
) -> Command:
    """Return a planner's answer as a command of plain values.

    Args:
        answer: What `act` returned.
        sensed: Ids of the obstacles that were sensed so far.
        beliefs: Beliefs that were checked before, which the answer may repeat.
        drive: How the robot moves; see `Task`.

    Raises:
        PlannerFailure: If it is no command, or a value in it is not sound.
    """
    if not isinstance(answer, Command):
        kind = one_line(type(answer).__name__)
        raise PlannerFailure(f"Expected act() to return a Command but it was {kind}.")
    velocity = _velocity(answer.velocity_mps)
    return Command(
        velocity_mps=velocity,
        give_up=_flag("give_up", answer.give_up),
        info=_info(answer.info, sensed, beliefs),
        turn_rate_radps=_turn_rate(answer.turn_rate_radps, velocity, drive),
    )


def _velocity(value: object) -> Array:
    velocity = _floats(value, most=2)
    if velocity is not None and velocity.shape == (2,):
        x, y = velocity.tolist()
        if abs(x) <= SPEED_MAX_MPS and abs(y) <= SPEED_MAX_MPS:
            return velocity
    raise PlannerFailure(
        "Expected a finite velocity of shape (2,), real numbers of at most 1e6 m/s, "
        f"but it was {_shown(value)}."
    )


def _turn_rate(value: object, velocity: Array, drive: Drive) -> float | None:
    if value is None:
        return None
    if drive != "differential":
        raise PlannerFailure(
            "Expected no turn_rate_radps for a robot that does not turn (task.drive is "
            f"'{drive}') but it was {_shown(value)}."
        )
    if float(velocity[1]) != 0.0:
        raise PlannerFailure(
            "Expected a velocity of (v, 0), in the robot's own frame, with "
            f"turn_rate_radps but it was {_shown(velocity)}."
        )
    rate = _real("turn_rate_radps", value)
    if abs(rate) > SPEED_MAX_MPS:
        raise _bad("turn_rate_radps", "finite and at most 1e6 rad/s", value)
    return rate


def _info(
    info: object, sensed: Mapping[str, object], before: Mapping[str, Probabilities]
) -> PlannerInfo:
    if not isinstance(info, PlannerInfo):
        raise _bad("info", "a PlannerInfo", info)
    action = _text("info.action", info.action, NAME_CHARS)
    if action not in ACTIONS:
        raise _bad("info.action", f"one of {', '.join(ACTIONS)}", action)
    return PlannerInfo(
        action=action,  # type: ignore[arg-type]
        reason=_text("info.reason", info.reason, DETAIL_CHARS),
        target=_target(info.target, sensed),
        cost_push=_cost("info.cost_push", info.cost_push),
        cost_detour=_cost("info.cost_detour", info.cost_detour),
        terms=_terms(info.terms),
        path_m=_path(info.path_m),
        beliefs=_beliefs(info.beliefs, sensed, before),
        replanned=_flag("info.replanned", info.replanned),
        expansions=_count("info.expansions", info.expansions),
    )


def _target(value: object, sensed: Mapping[str, object]) -> str | None:
    if value is None:
        return None
    target = _text("info.target", value, NAME_CHARS)
    if target not in sensed:
        raise PlannerFailure(
            f"Expected info.target to be a sensed obstacle but {target!r} was not "
            "sensed."
        )
    return target


def _terms(value: object) -> dict[str, float]:
    terms = _mapping("info.terms", value, TERMS)
    return {
        _text("a name in info.terms", name, NAME_CHARS): _real("info.terms", term)
        for name, term in terms
    }


def _path(value: object) -> Array | None:
    if value is None:
        return None
    path = _floats(value, most=2 * PATH_POINTS)
    if path is None or path.ndim != 2 or path.shape[1] != 2 or len(path) > PATH_POINTS:
        raise PlannerFailure(
            "Expected info.path_m of shape (m, 2), real numbers and at most "
            f"{PATH_POINTS} points, but it was {_shown(value)}."
        )
    if not (np.abs(path) <= COORDINATE_MAX_M).all():  # NaN and infinity included.
        raise PlannerFailure(
            "Expected info.path_m to be finite and within 1e6 m but it was not."
        )
    return path


def _beliefs(
    value: object, sensed: Mapping[str, object], before: Mapping[str, Probabilities]
) -> Mapping[str, Probabilities]:
    if type(value) is dict and _same_objects(value, before):
        return before
    out: dict[str, Probabilities] = {}
    for key, belief in _mapping("info.beliefs", value, max(len(sensed), 1)):
        name = _text("a name in info.beliefs", key, NAME_CHARS)
        if name not in sensed:
            raise PlannerFailure(
                f"Expected info.beliefs about sensed obstacles but {name!r} was not "
                "sensed."
            )
        out[name] = _belief(name, belief)
    return out


def _same_objects(value: dict[Any, Any], before: Mapping[str, Probabilities]) -> bool:
    """Whether names and beliefs are the very objects that were checked before.

    They are strings and tuples of floats, which do not change.
    """
    return (
        len(value) == len(before)
        and all(map(is_, value, before))
        and all(map(is_, value.values(), before.values()))
    )


def _belief(name: str, value: Any) -> Probabilities:
    """Return three probabilities; a sound tuple itself, which is cheap to compare."""
    if not (type(value) is tuple and len(value) == 3):
        value = _three(name, value)
    a, b, c = value
    if not (type(a) is float and type(b) is float and type(c) is float):
        a, b, c = value = tuple(_real("info.beliefs", p) for p in value)
    if a >= 0.0 and b >= 0.0 and c >= 0.0 and abs(a + b + c - 1.0) <= 1e-6:
        return value  # type: ignore[no-any-return]
    raise _no_belief(name, value)


def _three(name: str, value: Any) -> tuple[object, object, object]:
    values = _floats(value, most=3)
    if values is None or values.shape != (3,):
        raise _no_belief(name, value)
    a, b, c = values.tolist()
    return a, b, c


def _no_belief(name: str, value: object) -> PlannerFailure:
    return PlannerFailure(
        "Expected a belief to be three probabilities that sum to 1 but that about "
        f"{name!r} was {_shown(value)}."
    )


def _mapping(name: str, value: object, most: int) -> list[tuple[Any, Any]]:
    """Return the items of a mapping, read once."""
    if type(value) is not dict and not isinstance(value, Mapping):
        raise _bad(name, "a mapping", value)
    items = []
    for item in value.items():
        items.append(item)
        if len(items) > most:
            raise PlannerFailure(f"Expected {name} to have at most {most} entries.")
    return items


def _cost(name: str, value: object) -> float | None:
    return None if value is None else _real(name, value)


def _real(name: str, value: object) -> float:
    """Return a number as a float; infinity is one, NaN is not."""
    if type(value) is not float:
        if isinstance(value, np.ndarray) and value.shape == ():
            value = value[()]
        number = isinstance(value, int | float | np.integer | np.floating)
        if not number or isinstance(value, bool):
            raise _bad(name, "a real number", value)
        value = float.__float__(float(value))  # type: ignore[arg-type]
    if value != value:
        raise _bad(name, "a number", value)
    return value


def _count(name: str, value: object) -> int:
    if type(value) is not int:
        if not isinstance(value, int | np.integer) or isinstance(value, bool):
            raise _bad(name, "a whole number", value)
        value = int.__int__(int(value))
    if not 0 <= value <= COUNT_MAX:
        raise _bad(name, "between 0 and 2^53", value)
    return value


def _flag(name: str, value: object) -> bool:
    if value is True or value is False:
        return value
    if isinstance(value, np.ndarray) and value.shape == ():
        value = value[()]
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer) and int(value) in (0, 1):
        return int(value) == 1
    raise _bad(name, "true or false", value)


def _text(name: str, value: object, limit: int) -> str:
    """Return a text of at most `limit` characters that has a UTF-8 form."""
    if type(value) is not str:
        if not isinstance(value, str):
            raise _bad(name, "a text", value)
        value = str.__str__(value)
    if len(value) > limit:
        raise PlannerFailure(
            f"Expected {name} to be at most {limit} characters but it had {len(value)}."
        )
    if not value.isascii():
        try:
            value.encode()
        except UnicodeEncodeError:
            raise _bad(name, "text that has a UTF-8 form", value) from None
    return value


def _floats(value: Any, most: int) -> Array | None:
    """Return a copy as an array of floats; None if it is no array of real numbers.

    Nothing of more than `most` numbers is copied: an array of gigabytes may have been
    made of one number, with strides of zero.
    """
    if type(value) is not np.ndarray:
        if isinstance(value, str | bytes) or _length(value) > most:
            return None
        try:
            value = np.array(value)
        except (ValueError, TypeError, OverflowError):
            return None
    if value.size > most or (value.dtype.kind not in "fiu" and value.size):
        return None
    return np.array(value, np.float64, order="C", subok=False)


def _length(value: object) -> int:
    return len(value) if isinstance(value, Sized) else 0


def _bad(name: str, expected: str, value: object) -> PlannerFailure:
    return PlannerFailure(
        f"Expected {name} to be {expected} but it was {_shown(value)}."
    )


def _shown(value: object) -> str:
    """Return a value for a message: bounded, and safe to show."""
    if isinstance(value, np.ndarray) and value.size > 10:
        return f"an array of {value.dtype} and shape {value.shape}"
    return one_line(_SHORT.repr(value), 100)
