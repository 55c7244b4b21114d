"""Speed of generating, certifying, reading and checking scenes."""

from pytest_benchmark.fixture import BenchmarkFixture

from beacon_mj.scene.certificates import certify
from beacon_mj.scene.checks import check_scene
from beacon_mj.scene.files import parse_scene
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.mjcf import scene_mjcf
from tests.worlds import cached_scene


def test_generate(benchmark: BenchmarkFixture, family: str) -> None:
    scene = benchmark.pedantic(  # type: ignore[no-untyped-call]
        lambda: [generate_scene(family, i) for i in range(5)], rounds=3
    )
    assert len(scene) == 5


def test_certify(benchmark: BenchmarkFixture) -> None:
    scene = cached_scene("cluttered", 0)
    assert benchmark(certify, scene, 0.02) == scene.certificate


def test_parse_and_check(benchmark: BenchmarkFixture) -> None:
    data = cached_scene("cluttered", 0).to_json()
    assert len(benchmark(parse_scene, data).obstacles) >= 18


def test_check(benchmark: BenchmarkFixture) -> None:
    benchmark(check_scene, cached_scene("cluttered", 0))


def test_mjcf(benchmark: BenchmarkFixture) -> None:
    assert "<mujoco" in benchmark(scene_mjcf, cached_scene("cluttered", 0))
