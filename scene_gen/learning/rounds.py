"""Rounds: after how many scenes every latent world was dealt equally often."""

import math

from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.learning.latents import dealt_in_rounds
from beacon_mj.scene_gen.learning.layouts import LEARNING_LAYOUTS
from beacon_mj.streams import stream

SCENES = 100  #: Scenes of a family in a reported run, or what is nearest to it.


def round_scenes(family: Family) -> int:
    """Return how many scenes make a whole round; 1 where nothing is dealt in rounds.

    A round of w worlds that are equally probable has w scenes, or w missions with all
    their days. Where worlds are not equally probable each is drawn for itself, and a
    round is one mission, or one scene.

    Raises:
        TemplateError: If the family's numbers make no room.
    """
    if family.layout not in LEARNING_LAYOUTS:
        return 1
    days = family.whole("day_count") if "day_count" in family.numerics else 1
    # Any room of the family will do: all have the same number of worlds.
    room = LEARNING_LAYOUTS[family.layout](family, stream("scene", 0, "rounds"))
    worlds = [len(p.latent.weights) for p in room.parts if dealt_in_rounds(p)]
    return days * math.lcm(*worlds)


def default_scenes(family: Family, about: int = SCENES) -> int:
    """Return the number of whole rounds that is nearest to `about`, at least one."""
    length = round_scenes(family)
    return length * max(1, math.ceil(about / length - 0.5))


def cut_round(family: str, scenes: int, length: int) -> str | None:
    """Return a line that says that a number of scenes cuts a round, or None.

    Args:
        family: Its name, for the line.
        scenes: How many are run, from the first on.
        length: Scenes of a round.
    """
    if scenes % length == 0:
        return None
    below = scenes - scenes % length
    whole = f"{below} or {below + length}" if below else f"{length}"
    return (
        f"{family}: {scenes} scenes cut a round of {length}, so that the prior does "
        f"not hold exactly; {whole} would be whole rounds."
    )
