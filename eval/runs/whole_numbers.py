"""Whole numbers of an evaluation have the same bounds wherever they come from."""

from typing import Annotated

from msgspec import Meta

from beacon_mj.constants import WHOLE_NUMBERS
from beacon_mj.errors import RunError

_SEED, _SCENES = WHOLE_NUMBERS["seed"], WHOLE_NUMBERS["scenes_per_family"]
Seed = Annotated[int, Meta(ge=_SEED[0], le=_SEED[1])]
#: Planners times scenes of a run; nothing that long ends.
MAX_EPISODES = 10**6
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


def check_episodes(scenes: int, planners: int = 1) -> None:
    """Raise RunError if a run has too many episodes, before there is any of them."""
    if scenes * planners > MAX_EPISODES:
        raise RunError(
            f"Expected a run of at most {MAX_EPISODES} episodes but {scenes} scenes "
            f"and {planners} planners are {scenes * planners}."
        )
