"""What explains the 3-D picture: names, the planner's belief, and a legend.

An obstacle has the colour of its true class, the ball above it that of the planner's
belief: the classes' colours, mixed by their probabilities.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from beacon_mj.constants import CLASSES
from beacon_mj.interface import Probabilities
from beacon_mj.recording.drawing import (
    ARENA,
    ARROW_RGBA,
    BROKEN_RGBA,
    Values,
    new_entity,
    set_colour,
    set_pose,
    set_size,
    stamp,
)
from beacon_mj.recording.messages import message
from beacon_mj.scene import Scene
from beacon_mj.world import BaseWorld

DIGITS = 4  #: Of probabilities that are looked at; `/belief` has them whole.
PLAN_RGBA = (0.1, 0.45, 0.85, 1.0)  #: Colour of the planned path in the layouts.
TEXT_RGBA = (0.1, 0.1, 0.15, 1.0)
NAME_M, LEGEND_M = 0.12, 0.14  #: Heights of letters [m].
BALL_M = 0.14  #: Diameter of the ball that shows a belief [m].
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
#: Places of ball and name over an obstacle's top [m].
_BALL_OVER_M, _NAME_OVER_M = 0.1, 0.25
#: Where the legend's signs and words stand, south of the room [m].
_SIGNS_M, _WORDS_M = -0.32, -0.52


def labels(world: BaseWorld) -> Any:
    """Return the names of all obstacles, and the legend."""
    update = message("foxglove.SceneUpdate")()
    for o in world.scene.obstacles:
        entity = new_entity(update, o.id, o.id, 0)
        place = 0.0, 0.0, 0.5 * o.shape.height_m + _NAME_OVER_M
        _text(entity, o.id, place, NAME_M)
    _legend(update, world)
    return update


class BeliefPicture:
    """The beliefs of a planner as balls above the obstacles."""

    def __init__(self, scene: Scene) -> None:
        """Begin with no belief."""
        self._tops_m = {o.id: 0.5 * o.shape.height_m for o in scene.obstacles}
        self._colours = [surface.rgba[:3] for surface in scene.surfaces]
        self._shown: dict[str, tuple[Probabilities, Any]] = {}

    def update(self, beliefs: Mapping[str, Probabilities], time_ns: int) -> Any:
        """Return all beliefs as a picture; what is no longer believed is taken away."""
        update = message("foxglove.SceneUpdate")()
        for name in sorted(self._shown.keys() - beliefs.keys()):
            stamp(update.deletions.add(id=name).timestamp, time_ns)
            del self._shown[name]
        for name, belief in beliefs.items():
            shown = self._shown.get(name)
            if shown is None or shown[0] != belief:
                shown = self._shown[name] = belief, self._ball(name, belief, time_ns)
            update.entities.append(shown[1])
        return update

    def _ball(self, name: str, belief: Probabilities, time_ns: int) -> Any:
        """Return one ball; a click on it shows the probabilities."""
        entity = new_entity(message("foxglove.SceneUpdate")(), name, name, time_ns)
        for key, value in zip(CLASSES, belief, strict=True):
            entity.metadata.add(key=key, value=f"{value:.{DIGITS}f}")
        place = 0.0, 0.0, self._tops_m[name] + _BALL_OVER_M
        _add_ball(entity, place, (*_mixed(belief, self._colours), 1.0))
        return entity


def rounded_belief(beliefs: Mapping[str, Probabilities]) -> Any:
    """Return beliefs with as many digits as a person reads."""
    out = message("beacon_mj.Belief")()
    for name, belief in beliefs.items():
        safe, movable, fragile = (round(p, DIGITS) for p in belief)
        out.obstacles.add(obstacle=name, safe=safe, movable=movable, fragile=fragile)
    return out


def _mixed(
    belief: Probabilities, colours: Sequence[Sequence[float]]
) -> Iterator[float]:
    """Yield red, green and blue of a belief."""
    for channel in zip(*colours, strict=True):
        yield math.fsum(p * c for p, c in zip(belief, channel, strict=True))


def _legend(update: Any, world: BaseWorld) -> None:
    """Add one sign and one word for each colour, in a row south of the room."""
    entity = new_entity(update, "legend", ARENA, 0)
    west, south, east, _ = world.scene.workspace_m
    signs = list(_signs(world))
    step = (east - west) / len(signs)
    for k, (word, sign, rgba) in enumerate(signs):
        x = west + (k + 0.5) * step
        _add_sign(entity, sign, (x, south + _SIGNS_M, 0.06), rgba)
        _text(entity, word, (x, south + _WORDS_M, 0.06), LEGEND_M)


def _signs(world: BaseWorld) -> Iterator[tuple[str, str, Values]]:
    """Yield word, sign and colour of each line of the legend."""
    for kind, surface in zip(CLASSES, world.scene.surfaces, strict=True):
        yield kind, "cube", surface.rgba
    yield "broken", "cube", BROKEN_RGBA
    yield "belief", "ball", world.scene.surfaces[1].rgba
    yield "path", "bar", PLAN_RGBA
    yield "force", "bar", ARROW_RGBA
    for name in ("start", "goal"):
        yield name, "disc", world.model.site(name).rgba.tolist()


def _add_sign(entity: Any, sign: str, place: Values, rgba: Values) -> None:
    if sign == "ball":
        return _add_ball(entity, place, rgba)
    if sign == "disc":
        shape = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
    else:
        shape = entity.cubes.add()
    sizes = {"cube": (0.12,) * 3, "bar": (0.3, 0.04, 0.04), "disc": (0.16, 0.16, 0.01)}
    set_size(shape.size, sizes[sign])
    set_pose(shape.pose, place, _UPRIGHT)
    set_colour(shape.color, rgba)
    return None


def _add_ball(entity: Any, place: Values, rgba: Values) -> None:
    ball = entity.spheres.add()
    set_size(ball.size, (BALL_M, BALL_M, BALL_M))
    set_pose(ball.pose, place, _UPRIGHT)
    set_colour(ball.color, rgba)


def _text(entity: Any, words: str, place: Values, height_m: float) -> None:
    text = entity.texts.add(text=words, font_size=height_m, billboard=True)
    set_pose(text.pose, place, _UPRIGHT)
    set_colour(text.color, TEXT_RGBA)
