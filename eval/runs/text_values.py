"""One value given as text, such as `0.5,0,0.5`, turned into what its field holds.

Numbers, truth values, words of a `Literal`, lists, tuples and sets of them, with or
without brackets, `none` where a field may be None, `unset` where it may be left out.

A type with a method `from_text` reads itself, and its `WORDS` say what it takes: this
module is loaded in processes of planners, and must not load what holds the truth.
"""

import math
import types
from collections.abc import Iterable
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec
from msgspec import UNSET, UnsetType

_OPEN, _CLOSE = "[(", "])"
_SEQUENCES = (tuple, list, set, frozenset)
_WORDS = {
    float: "a finite number",
    int: "an integer",
    bool: "true or false",
    str: "text",
}
_NOTHING = (type(None), UnsetType)
_LIMITS = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}


class BadValue(Exception):
    """A text that is no value of its field's type."""


def parse_value(text: str, hint: Any) -> Any:
    """Return the value of type `hint` that a text stands for.

    Raises:
        BadValue: If there is none, or a number in it is not finite.
    """
    if UnsetType in get_args(hint) and text.lower() == "unset":
        return UNSET
    try:
        value = msgspec.convert(_structured(text, hint), hint, strict=False)
    except (msgspec.ValidationError, BadValue) as problem:
        raise BadValue(text) from problem
    if not all(math.isfinite(number) for number in _floats(value)):
        raise BadValue(text)
    return value


def describe(hint: Any) -> str:
    """Return what a value of a type looks like, to follow "Expected x to be"."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        limits = _limits(arguments[1:])
        return (
            f"{describe(arguments[0])} {limits}" if limits else describe(arguments[0])
        )
    if origin in (Union, types.UnionType):
        return " or ".join(describe(each) for each in arguments)
    if hint is UnsetType:
        return "unset"
    if origin is Literal:
        return f"one of {', '.join(map(str, arguments))}"
    if origin is tuple and arguments[-1:] != (...,):
        return f"{len(arguments)} values, each {describe(arguments[0])}"
    if origin in _SEQUENCES:
        return f"a list such as [a,b], each {describe(arguments[0])}"
    if hint is type(None):
        return "none"
    name = getattr(hint, "__name__", str(hint))
    return _WORDS.get(hint, str(getattr(hint, "WORDS", name)))


def _limits(metas: Iterable[Any]) -> str:
    """Return the limits that annotations set, such as `>= 0 and < 1`."""
    found = [
        f"{sign} {limit:.12g}"
        for meta in metas
        for name, sign in _LIMITS.items()
        if (limit := getattr(meta, name, None)) is not None
    ]
    return " and ".join(found)


def _structured(text: str, hint: Any) -> Any:
    """Return the text, or a list of texts where the type holds several values."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _structured(text, arguments[0])
    if origin in (Union, types.UnionType):
        if type(None) in arguments and text.lower() in ("none", "null"):
            return None
        rest = [each for each in arguments if each not in _NOTHING]
        return _structured(text, rest[0]) if len(rest) == 1 else text
    if hint is bool:
        return text.lower()
    if hasattr(hint, "from_text"):
        return hint.from_text(text)
    if origin not in _SEQUENCES and hint not in _SEQUENCES:
        return text
    parts = _parts(text)
    if origin is tuple and arguments[-1:] != (...,):
        if len(parts) != len(arguments):
            raise BadValue(text)
        return [_structured(p, a) for p, a in zip(parts, arguments, strict=True)]
    return [_structured(part, arguments[0] if arguments else str) for part in parts]


def _parts(text: str) -> list[str]:
    """Return what stands between the commas that are in no inner brackets."""
    text = text.strip()
    if text[:1] and text[0] in _OPEN and _closes(text) == len(text) - 1:
        text = text[1:-1]
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in _OPEN) - (letter in _CLOSE)
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    parts = [_unquoted(part.strip()) for part in parts]
    return parts[:-1] if parts[-1] == "" else parts  # `[]`, and a comma at the end.


def _closes(text: str) -> int:
    """Return where the bracket that a text begins with is closed, -1 if nowhere."""
    depth = 0
    for k, letter in enumerate(text):
        depth += (letter in _OPEN) - (letter in _CLOSE)
        if depth == 0:
            return k
    return -1


def _unquoted(text: str) -> str:
    quoted = len(text) > 1 and text[0] == text[-1] and text[0] in "'\""
    return text[1:-1] if quoted else text


def _floats(value: Any) -> Iterable[float]:
    """Yield every float in a value."""
    if isinstance(value, float):
        yield value
    elif isinstance(value, _SEQUENCES):
        for each in value:
            yield from _floats(each)
