"""Perception profiles: exact, calibrated, and misleading, as they say."""

import math

import msgspec
import numpy as np
import pytest

from beacon_mj.constants import CLASSES, GRAVITY, InteractionClass
from beacon_mj.fidelity.benches import bench, obstacle
from beacon_mj.scene import Obstacle, Profile, Scene, Sensing
from beacon_mj.scene.shapes import Cylinder
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.perception import (
    BASE_RATES,
    MATERIAL_ERROR,
    force_errors,
    perceive,
)
from beacon_mj.streams import stream
from tests.worlds import cached_scene

COUNT = 12_000


def crowd(seed: int = 0) -> Scene:
    """A scene of 400 obstacles with classes drawn at the base rates (never checked)."""
    rng = np.random.default_rng(seed)
    return bench(
        *(_member(k, CLASSES[rng.choice(3, p=BASE_RATES)]) for k in range(400))
    )


def _member(k: int, interaction: InteractionClass) -> Obstacle:
    return obstacle(
        f"o{k}",
        Cylinder(radius_m=0.1, height_m=0.3),
        interaction=interaction,
        break_force_n=10.0 if interaction == "fragile" else None,
    )


def draws(profile: Profile) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return true classes, normalised scores, and logs of material ratios."""
    truth, scores, errors = [], [], []
    for seed in range(COUNT // 400):
        for o in perceive(crowd(seed), profile, seed).obstacles:
            truth.append(CLASSES.index(o.interaction))
            scores.append(np.array(o.perceived.scores) / sum(o.perceived.scores))
            ratio = (
                o.perceived.density_kgm3 / o.density_kgm3,
                o.perceived.friction / o.friction,
            )
            errors.append(np.log(ratio))
    return np.array(truth), np.array(scores), np.array(errors)


def test_truth_is_exact() -> None:
    truth, scores, errors = draws("truth")
    np.testing.assert_array_equal(scores, np.eye(3)[truth])
    np.testing.assert_array_equal(errors, 0.0)


def test_noisy_is_right_about_eight_times_in_ten() -> None:
    truth, scores, _ = draws("noisy")
    assert (scores.argmax(axis=1) == truth).mean() == pytest.approx(0.8, abs=0.025)
    assert scores.min() > 0.0


@pytest.mark.parametrize("label", range(3))
def test_noisy_is_calibrated(label: int) -> None:
    """In each tenth of the scores, the share of the class is the mean score.

    The sum of squared deviations, each in its standard error, is chi-square with
    one degree of freedom a bin; 99.9 % of such sums are below 29.6 for ten bins.
    The floor under scores is worth a little more.
    """
    truth, scores, _ = draws("noisy")
    s, hit = scores[:, label], truth == label
    statistic = 0.0
    for low in np.arange(10) / 10.0:
        inside = (s >= low) & (s < low + 0.1 + 1e-9)
        assert inside.sum() > 30
        mean = s[inside].mean()
        error = np.sqrt((s[inside] * (1.0 - s[inside])).sum()) / inside.sum()
        statistic += ((hit[inside].mean() - mean) / error) ** 2
    assert statistic < 40.0


def test_misleading_is_right_half_the_time_and_sure_of_itself() -> None:
    truth, scores, _ = draws("misleading")
    top = scores.max(axis=1)
    assert (scores.argmax(axis=1) == truth).mean() == pytest.approx(0.5, abs=0.02)
    assert top.min() > 0.8
    wrong = scores[scores.argmax(axis=1) != truth].argmax(axis=1)
    assert set(wrong) == {0, 1, 2}


@pytest.mark.parametrize("profile", ["noisy", "misleading"])
def test_material_errors_are_unbiased_and_independent(profile: Profile) -> None:
    _, _, errors = draws(profile)
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=0.006)
    np.testing.assert_allclose(errors.std(axis=0), MATERIAL_ERROR, rtol=0.03)
    assert abs(np.corrcoef(errors.T)[0, 1]) < 0.03


def test_profiles_change_what_is_perceived_and_nothing_else() -> None:
    scene = cached_scene("cluttered", 0)
    truth = perceive(scene, "truth", 0)
    for profile in ("noisy", "misleading"):
        other = perceive(scene, profile, 0)
        assert other.perception == profile
        for a, b in zip(truth.obstacles, other.obstacles, strict=True):
            assert a != b
            assert msgspec.structs.replace(b, perceived=a.perceived) == a
        assert other.certificate == truth.certificate


def test_perception_repeats_with_its_seed_only() -> None:
    scene = cached_scene("sparse", 0)
    assert perceive(scene, "noisy", 1) == perceive(scene, "noisy", 1)
    assert perceive(scene, "noisy", 1) != perceive(scene, "noisy", 2)
    twice = perceive(perceive(scene, "misleading", 5), "noisy", 1)
    assert twice == perceive(scene, "noisy", 1)


def test_streams_are_independent() -> None:
    keys = [
        ("scene", 0, "sparse", 0), ("perception", 0, "sparse", 0),
        ("sensor", 0, "sparse", 0), ("planner", 0, "sparse", 0),
        ("scene", 1, "sparse", 0), ("scene", 0, "sparse", 1),
        ("scene", 0, "cluttered", 0),
    ]  # fmt: skip
    drawn = np.array([stream(*key).standard_normal(2000) for key in keys])  # type: ignore[arg-type]
    correlation = np.corrcoef(drawn) - np.eye(len(keys))
    assert np.abs(correlation).max() < 0.1
    again = stream("scene", 0, "sparse", 0).standard_normal(2000)
    np.testing.assert_array_equal(drawn[0], again)


@pytest.mark.parametrize("material_error", [None, 0.4, 1.0])
def test_the_data_sheet_says_how_wrong_perceived_forces_are(
    material_error: float | None,
) -> None:
    logs = []
    sensing = Sensing(material_error=material_error)
    for seed in range(10):
        scene = msgspec.structs.replace(crowd(seed), sensing=sensing)
        found = perceive(scene, "noisy", seed)
        logs += [
            np.log(
                o.density_kgm3
                * o.friction
                / (o.perceived.density_kgm3 * o.perceived.friction)
            )
            for o in found.obstacles
        ]
        own, common = force_errors(found)
    assert np.std(logs) == pytest.approx(own, rel=0.05)
    assert np.mean(logs) == pytest.approx(0.0, abs=0.05 * own)
    assert common == 0.0


def test_the_usual_error_of_a_force_is_a_fifth_and_truth_has_none() -> None:
    scene = cached_scene("cluttered", 0)
    assert force_errors(scene) == (0.21, 0.0)
    assert force_errors(perceive(scene, "misleading", 0)) == (0.21, 0.0)
    assert force_errors(perceive(scene, "truth", 0)) == (0.0, 0.0)


def test_the_sheet_of_a_family_that_perceives_for_itself() -> None:
    """Of the loads of whole rounds the sheet's error is the standard deviation."""
    family = "unweighed-doors"
    loads, own = [], []
    for index in range(10):
        scene = generate_scene(family, index, 2000)
        logs = np.array([
            math.log(o.breakaway_force_n / perceived_n(o))
            for o in scene.obstacles
            if not o.fixed
        ])  # fmt: skip
        loads.append(logs.mean())
        own.append(logs.std())
    errors = force_errors(scene)
    assert errors.force_scale_error == pytest.approx(np.std(loads), rel=0.1)
    assert errors.force_error == pytest.approx(np.mean(own), rel=0.3)
    control = generate_scene(f"{family}-redrawn", 0, 2000)
    assert force_errors(control) == errors
    assert force_errors(perceive(scene, "truth", 0)) == (0.0, 0.0)


def perceived_n(o: Obstacle) -> float:
    seen = o.perceived
    return seen.friction * seen.density_kgm3 * o.shape.volume_m3 * GRAVITY
