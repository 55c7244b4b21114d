"""Whole numbers of an evaluation have the same bounds wherever they come from."""

from typing import Annotated

from msgspec import Meta

from beacon_mj.constants import WHOLE_NUMBERS
from beacon_mj.errors import RunError

_SEED, _SCENES = WHOLE_NUMBERS["seed"], WHOLE_NUMBERS["scenes_per_family"]
Seed = Annotated[int, Meta(ge=_SEED[0], le=_SEED[1])]
SceneCount = Annotated[int, Meta(ge=_SCENES[0], le=_SCENES[1])]


def check_whole_numbers(**given: object) -> None:
    """Check options that are whole numbers, by name; None stands for "unsaid".

    Raises:
        RunError: If one is no whole number, or out of its bounds.
    """
    for name, value in given.items():
        # Of `fresh_seed` and the like the last word says what they are.
        low, high = WHOLE_NUMBERS.get(name) or WHOLE_NUMBERS[name.rpartition("_")[2]]
        if value is None or (type(value) is int and low <= value <= high):
            continue
        raise RunError(
            f"--{name.replace('_', '-')}: expected a whole number from {low} to {high} "
            f"but it was {value!r}."
        )
