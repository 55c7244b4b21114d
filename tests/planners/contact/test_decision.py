"""What is said of push or go round is what was compared."""

import math
import re

import pytest

from beacon_mj.episode.run import run_episode
from beacon_mj.interface import PlannerInfo
from beacon_mj.planners.beacon import Beacon, BeaconConfig
from beacon_mj.scene_gen.generate import generate_scene

SCENES = [("collision-required", 0), ("hard-shortcut", 0)]
_SIDE = r"(-?[\d.]+) \(([\d.]+) ([-+] [\d.]+)\)"
_REASON = re.compile(rf"(Push|Go round): {_SIDE}, .* than {_SIDE} for")


@pytest.fixture(scope="module")
def decisions() -> list[PlannerInfo]:
    """What BEACON says at each step at which it has compared."""
    return [
        info
        for family, index in SCENES
        for step in run_episode(generate_scene(family, index), Beacon()).steps
        if (info := step.command.info).cost_push is not None
    ]


def test_the_lower_of_two_logged_costs_was_chosen(decisions: list[PlannerInfo]) -> None:
    config, chosen = BeaconConfig(), set()
    for info in decisions:
        assert info.cost_push is not None
        assert info.cost_detour is not None
        cost, pushing = (
            math.fsum(info.terms.values()),
            info.cost_push < info.cost_detour,
        )
        chosen.add(pushing)
        if pushing:
            assert info.cost_push == cost - config.push_bias
        else:
            assert info.cost_detour == cost + config.detour_margin
    assert chosen == {True, False}


def test_the_reason_shows_what_was_compared(decisions: list[PlannerInfo]) -> None:
    """The dearer way may win by bonus and margin, and must not look wrong."""
    found = [(i, m.groups()) for i in decisions if (m := _REASON.match(i.reason))]
    seen, dearer = set(), 0
    for info, (name, *sides) in found:
        seen.add(name)
        push, detour = sides[:3], sides[3:]
        if name == "Go round":
            push, detour = detour, push
        assert float(push[0]) == pytest.approx(info.cost_push, abs=0.006)
        assert float(detour[0]) == pytest.approx(info.cost_detour, abs=0.006)
        assert (push[2], detour[2]) == ("- 0.35", "+ 0.50")
        dearer += name == "Push" and float(push[1]) > float(detour[1])
    assert seen == {"Push", "Go round"}
    assert dearer > 0
