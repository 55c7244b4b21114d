"""The cache of scenes: the same bytes as without it, never a stale or damaged one."""

import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import beacon_mj
from beacon_mj.eval.runs import scene_cache
from beacon_mj.eval.runs.scene_cache import VARIABLE, cached_scene, generator_sources
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import PROFILES, Scene
from beacon_mj.scene_gen.generate import generate_scene

Arguments = tuple[object, ...]


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def generated(monkeypatch: pytest.MonkeyPatch) -> list[Arguments]:
    """Return the list that grows with everything that is generated from now on."""
    found: list[Arguments] = []

    def generate(*arguments: object) -> Scene:
        found.append(arguments)
        return generate_scene(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(scene_cache, "generate_scene", generate)
    return found


def entries(cache: Path) -> list[Path]:
    return sorted(path for path in cache.rglob("*") if path.is_file())


def test_scenes_are_the_same_bytes_and_made_once(
    family: str, cache: Path, generated: list[Arguments]
) -> None:
    for profile in PROFILES:
        plain = generate_scene(family, 3, 7, profile).to_json()
        for _ in range(2):
            assert cached_scene(family, 3, 7, profile).to_json() == plain
    assert len(generated) == len(entries(cache)) == len(PROFILES)


def test_another_scene_is_another_entry(
    cache: Path, generated: list[Arguments], monkeypatch: pytest.MonkeyPatch
) -> None:
    cached_scene("sparse", 0, 0, "noisy")
    cached_scene("sparse", 1, 0, "noisy")
    cached_scene("sparse", 0, 1, "noisy")
    cached_scene("cluttered", 0, 0, "noisy")
    monkeypatch.setattr(scene_cache, "CODE_SHA256", "another generator's")
    cached_scene("sparse", 0, 0, "noisy")
    monkeypatch.setattr(scene_cache, "_versions", lambda: "other versions")
    cached_scene("sparse", 0, 0, "noisy")
    assert len(generated) == len(entries(cache)) == 6


@pytest.mark.parametrize("file", ["families/mine.xml", "obstacles/box.xml"])
def test_an_edited_family_makes_other_scenes(
    file: str, cache: Path, tmp_path: Path
) -> None:
    for source, copy in (
        ("families/sparse.xml", "families/mine.xml"),
        ("obstacles/box.xml", "obstacles/box.xml"),
    ):
        (tmp_path / copy).parent.mkdir()
        (tmp_path / copy).write_text((ROOT / source).read_text())

    def scenes(make: Callable[..., Scene]) -> list[Scene]:
        return [make("mine", k, 0, "noisy", tmp_path) for k in range(3)]

    before = scenes(cached_scene)
    text = (tmp_path / file).read_text()
    text = text.replace('"0.25 0.6"', '"0.25 0.3"')  # In the family.
    text = text.replace('type="box"', 'type="cylinder"')  # In the obstacle.
    (tmp_path / file).write_text(text)
    after = scenes(cached_scene)
    assert after != before
    assert after == scenes(generate_scene)


@pytest.mark.parametrize(
    "harm",
    [
        lambda data: b"",
        lambda data: b"nonsense",
        lambda data: data[:-200],
        lambda data: data[:-1],
        lambda data: data.replace(b'"simulated": null', b'"simulated": "ok"'),
        lambda data: b"0" * 64 + data[64:],
        lambda data: data.partition(b"\n")[2],
    ],
)
def test_a_damaged_entry_is_made_again(
    harm: Callable[[bytes], bytes], cache: Path, generated: list[Arguments]
) -> None:
    plain = cached_scene("sparse", 0, 0, "noisy")
    [entry] = entries(cache)
    whole = entry.read_bytes()
    entry.write_bytes(harm(whole))
    assert entry.read_bytes() != whole
    assert cached_scene("sparse", 0, 0, "noisy") == plain
    assert entry.read_bytes() == whole
    assert len(generated) == 2


def test_an_entry_under_anothers_name_is_not_believed(cache: Path) -> None:
    cached_scene("sparse", 0, 0, "noisy")
    [first] = entries(cache)
    plain = cached_scene("sparse", 1, 0, "noisy")
    [second] = [path for path in entries(cache) if path != first]
    second.write_bytes(first.read_bytes())
    assert cached_scene("sparse", 1, 0, "noisy") == plain


@pytest.mark.parametrize("value", ["", "off"])
def test_the_cache_can_be_off(
    value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(VARIABLE, value)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "usual"))
    assert cached_scene("sparse", 0, 0, "noisy") == generate_scene("sparse", 0)
    assert [*tmp_path.iterdir()] == []
    monkeypatch.delenv(VARIABLE)
    assert str(scene_cache.cache_folder()).startswith(str(tmp_path / "usual"))


def test_a_folder_that_cannot_be_used_costs_nothing_but_time(cache: Path) -> None:
    cache.write_text("a file")
    assert cached_scene("sparse", 0, 0, "noisy") == generate_scene("sparse", 0)
    assert cache.read_text() == "a file"


def test_the_cache_is_bounded(
    cache: Path, generated: list[Arguments], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scene_cache, "BUCKET", 2)
    path = cache / "scenes" / "00"
    scene = generate_scene("sparse", 0)
    for k in range(5):
        scene_cache._write(path / f"{k:064x}", scene)
    assert [int(p.name, 16) for p in entries(cache)] == [3, 4]


def test_many_at_once_never_meet_half_an_entry(cache: Path) -> None:
    plain = generate_scene("sparse", 0)
    cached_scene("sparse", 0, 0, "noisy")
    [path] = entries(cache)

    def both(number: int) -> bool:
        if number % 2:
            scene_cache._write(path, plain)
        return scene_cache._read(path) == plain

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(both, range(200)))
    assert entries(cache) == [path]


def test_every_module_that_makes_scenes_is_part_of_the_name() -> None:
    code = (
        "import sys, beacon_mj.scene_gen.generate\n"
        "print(*[m.__file__ for n, m in sys.modules.items()"
        " if n.split('.')[0] == 'beacon_mj'], sep='\\n')"
    )
    root = Path(beacon_mj.__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=root.parent, capture_output=True, text=True, check=True,
    )  # fmt: skip
    known = {path.resolve() for path in generator_sources()}
    loaded = {Path(line).resolve() for line in done.stdout.split()}
    assert loaded <= known
    assert len(loaded) > 12
    folders = {path.parent.name for path in known}
    assert {"motion", "scene", "scene_gen", "beacon_mj"} <= folders
