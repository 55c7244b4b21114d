"""Values given as text: what is read back, what is refused, and in which words."""

from types import GenericAlias
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from beacon_mj.eval.runs.text_values import BadValue, describe, parse_value

Kind = Literal["kind", "scale"]
finite = st.floats(allow_nan=False, allow_infinity=False)
brackets = st.sampled_from(["{}", "[{}]", "({})", " [ {} ] ", "[{},]"])


@given(finite)
def test_a_number_is_read_back(number: float) -> None:
    assert parse_value(str(number), float) == number
    assert parse_value(str(number), float | None) == number


@given(st.lists(finite, min_size=1), brackets)
def test_numbers_are_read_back(numbers: list[float], form: str) -> None:
    text = form.format(",".join(map(str, numbers)))
    assert parse_value(text, list[float]) == numbers
    assert parse_value(text, tuple[float, ...]) == tuple(numbers)
    exact = GenericAlias(tuple, tuple([float] * len(numbers)))
    assert parse_value(text, exact) == tuple(numbers)


@given(st.frozensets(st.sampled_from(["kind", "scale"])), brackets)
def test_words_of_a_set_are_read_back(words: frozenset[str], form: str) -> None:
    text = form.format(",".join(sorted(words)))
    if words:
        assert parse_value(text, frozenset[Kind]) == words
    assert parse_value(f"[{','.join(sorted(words))}]", frozenset[Kind]) == words


@pytest.mark.parametrize(
    ("text", "hint", "value"),
    [
        ("true", bool, True),
        ("False", bool, False),
        ("none", float | None, None),
        ("null", Annotated[float, Meta(ge=0.0)] | None, None),
        ("7", int, 7),
        ("left", Literal["left", "right"], "left"),
        ("['kind', \"scale\"]", list[Kind], ["kind", "scale"]),
        ("[]", frozenset[Kind], frozenset()),
        ("", tuple[Kind, ...], ()),
        ("(1,2),(3,4)", tuple[tuple[float, float], ...], ((1.0, 2.0), (3.0, 4.0))),
        ("[[1,2]]", list[list[int]], [[1, 2]]),
        ("a,b", str, "a,b"),
    ],
)
def test_texts_of_all_kinds(text: str, hint: Any, value: object) -> None:
    assert parse_value(text, hint) == value


@pytest.mark.parametrize(
    ("text", "hint", "words"),
    [
        ("fast", float, "a finite number"),
        ("nan", float, "a finite number"),
        ("-inf", float, "a finite number"),
        ("1e999", float, "a finite number"),
        ("1,nan,2", tuple[float, float, float], "3 values, each a finite number"),
        ("1,2", tuple[float, float, float], "3 values, each a finite number"),
        ("1.5", int, "an integer"),
        ("maybe", bool, "true or false"),
        ("up", Literal["left", "right"], "one of left, right"),
        ("[colour]", frozenset[Kind], "a list such as [a,b], each one of kind, scale"),
        ("x", float | None, "a finite number or none"),
        ("-1", Annotated[float, Meta(ge=0.0, lt=1.0)], "a finite number >= 0 and < 1"),
        ("0", Annotated[int, Meta(ge=1, le=10**6)], "an integer >= 1 and <= 1000000"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(
    text: str, hint: Any, words: str
) -> None:
    with pytest.raises(BadValue):
        parse_value(text, hint)
    assert describe(hint) == words


@given(st.text(), st.sampled_from([float, bool, list[float], frozenset[Kind]]))
def test_any_text_is_a_value_or_refused(text: str, hint: Any) -> None:
    try:
        parse_value(text, hint)
    except BadValue:
        pass
