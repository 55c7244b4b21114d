"""Tables of several worlds, and single pushes in all of them."""

import math

import pytest

from beacon_mj.episode.run import run_episode
from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.report.single_pushes import force_ratios, predictions
from beacon_mj.eval.report.worlds import (
    _kept,
    comparison,
    differences,
    on_common_scenes,
)
from beacon_mj.eval.report.worlds_figures import (
    cascade_panels,
    difference_panels,
    energy_panel,
)
from beacon_mj.eval.statistics.intervals import Interval
from beacon_mj.eval.studies.push_trials import WORLDS, pushes
from beacon_mj.planners.registry import load_planner
from tests.worlds import cached_scene


@pytest.fixture(scope="module")
def rows() -> dict[str, list[Row]]:
    return {
        world: [
            measure(run_episode(scene, load_planner(name)[1](), name, protocol))
            for scene in (cached_scene("cluttered", i) for i in range(2))
            for name in ("beacon", "dstar-lite")
        ]
        for world, protocol in WORLDS.items()
    }


def test_all_worlds_are_compared_on_their_common_scenes(
    rows: dict[str, list[Row]],
) -> None:
    shared = on_common_scenes({**rows, "paper": rows["paper"][:2]})
    assert {len(own["beacon"]) for own in shared.values()} == {1}
    text = comparison(on_common_scenes(rows))
    assert "2 scenes (2 cluttered)" in text
    for world in WORLDS:
        assert f"| beacon | {world} | 100 [34, 100] |" in text
    assert "| beacon | the paper | 96.75 | 132.16 | 5.053 |" in text


def test_runs_without_common_scenes_are_refused(rows: dict[str, list[Row]]) -> None:
    with pytest.raises(RunError, match="share none"):
        on_common_scenes({"mujoco": rows["mujoco"][:2], "paper": rows["paper"][2:]})


@pytest.mark.parametrize(
    ("physical", "planar", "said"),
    [
        ((2, 1, 3), (2.5, 2, 4), "sign and size"),
        ((2, 1, 3), (9, 8, 10), "sign"),
        ((2, 1, 3), (-2, -3, -1), "reversed"),
        ((2, 1, 3), (0, -1, 1), "lost"),
        ((0, -1, 1), (2, 1, 3), "only there"),
        ((0, -1, 1), (0, -1, 1), "none to keep"),
    ],
)
def test_what_is_kept_of_a_difference(
    physical: tuple[float, float, float],
    planar: tuple[float, float, float],
    said: str,
) -> None:
    assert _kept(Interval(*physical), Interval(*planar)) == said


def test_a_push_moves_in_every_world_what_is_predicted() -> None:
    found = list(pushes(["sparse"], 2))
    assert len(found) >= 3
    free = [p for p in found if p.feasible and p.shape not in ("sphere", "capsule")]
    assert free
    for push in free:
        for trial in push.trials.values():
            assert push.first in trial.moved
            assert trial.evidence == "moved"
        paper = push.trials["paper"]
        assert paper.moved == push.predicted
        assert math.isclose(paper.work_j, paper.model_j, rel_tol=0.01)
        assert math.isclose(paper.force_n, push.breakaway_n, rel_tol=1e-9)
    assert force_ratios(free, "paper") == pytest.approx([1.0] * len(free))
    text = predictions(found)
    assert f"| all | {len(found)} | mujoco |" in text
    for drawn in (cascade_panels(found), energy_panel(found)):
        assert drawn.count("<svg") == 1


def test_differences_of_all_worlds_are_drawn(rows: dict[str, list[Row]]) -> None:
    spans = differences(on_common_scenes(rows))
    found = {key: dict(zip(rows, each, strict=True)) for key, each in spans.items()}
    assert {name for name, _ in found} == {"dstar-lite"}
    assert difference_panels(found) == difference_panels(found)
    few = {key: {"mujoco": each["mujoco"]} for key, each in found.items()}
    assert len(difference_panels(few)) < len(difference_panels(found))
