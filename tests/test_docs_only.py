"""What a reader does from docs/own-families.md alone, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import polars
import pytest

from beacon_mj.scene import shapes
from beacon_mj.scene_gen.generate import generate_scene
from tests.pages import parts
from tests.repository import REPOSITORY

TEXT = (REPOSITORY / "docs" / "own-families.md").read_text()
IN_SMALL = "--scenes-per-family 2 --out run --json"


def files(text: str) -> dict[str, str]:
    """Return the files that a page says to save, by name."""
    return {block.title: block.text for block in parts(text) if block.title}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in files(TEXT).items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def run(command: str, folder: Path) -> None:
    command = command.replace("beacon-mj", f"{sys.executable} -m beacon_mj")
    environment = os.environ | {
        "PYTHONPATH": str(REPOSITORY),
        "BEACON_MJ_CACHE": str(folder / "cache"),
    }
    done = subprocess.run(
        command.split(), cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"


def hashes(folder: Path) -> set[str]:
    rows = polars.read_parquet(folder / "run" / "episodes.parquet")
    assert rows["family"].to_list() == ["ring", "ring"]
    return set(rows["scene_sha256"].to_list())


def test_own_family_obstacle_and_layout_with_two_workers(folder: Path) -> None:
    assert {p.name for p in folder.rglob("*.*")} == {
        "chair.xml",
        "layouts.py",
        "ring.xml",
    }
    [command] = re.findall(r"^beacon-mj eval .*--family ring.*$", TEXT, re.M)
    assert "--workers 2" in command
    run(f"{command} {IN_SMALL}", folder)
    scenes = [generate_scene("ring", k, templates=folder / "my_dir") for k in range(2)]
    assert hashes(folder) == {scene.sha256 for scene in scenes}
    for scene in scenes:
        assert 4 <= len(scene.obstacles) <= 6
        for o in scene.obstacles:
            assert shapes.name_of(o.shape) == "chair"
            assert (o.x_m - 3.0) ** 2 + (o.y_m - 3.0) ** 2 == pytest.approx(1.5**2)


def test_an_edited_layout_is_what_the_next_run_uses(folder: Path) -> None:
    [command] = re.findall(r"^beacon-mj eval .*--family ring.*$", TEXT, re.M)
    run(f"{command} {IN_SMALL}", folder)
    before = hashes(folder)
    layouts = folder / "my_dir" / "layouts.py"
    layouts.write_text(layouts.read_text().replace("1.5 *", "1.2 *"))
    run(f"{command} {IN_SMALL.replace('run', 'again')}", folder)
    (folder / "run").rename(folder / "first")
    (folder / "again").rename(folder / "run")
    assert not hashes(folder) & before


def test_an_obstacle_written_with_pymjcf(tmp_path: Path) -> None:
    pytest.importorskip("dm_control", reason="no dm-control here")
    [program] = re.findall(r"```python\n([^`]*save_obstacle.*?)```", TEXT, re.S)
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path, env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    text = files(TEXT)["my_dir/ring.xml"]
    (tmp_path / "my_dir" / "ring.xml").write_text(
        text.replace("chair", "stool").replace('"layout" data="ring"',
                                               '"layout" data="scatter"')
        .replace("<custom>", '<custom><numeric name="spacing" data="0.1"/>')
    )  # fmt: skip
    scene = generate_scene("ring", 0, templates=tmp_path / "my_dir")
    assert {shapes.name_of(o.shape) for o in scene.obstacles} == {"stool"}


def edits_of_the_learning_family() -> dict[str, str]:
    """Return the lines that the page changes in a copy, by the start of the line."""
    section = TEXT.partition("## A learning family of your own")[2]
    [block] = re.findall(r"```xml\n(.*?)```", section.partition("\n## ")[0], re.S)
    return {line.partition(" data=")[0]: line for line in block.splitlines()}


def test_a_learning_family_of_ones_own_from_the_page_alone(tmp_path: Path) -> None:
    """Copied, edited in XML only, certified in MuJoCo, and crossed by a robot."""
    section = TEXT.partition("## A learning family of your own")[2]
    [copy] = re.findall(r"^mkdir my_doors && cp (\S+) (\S+)$", section, re.M)
    path = tmp_path / copy[1]
    path.parent.mkdir()
    text = (REPOSITORY / copy[0]).read_text()
    edits = edits_of_the_learning_family()
    assert len(edits) == 5
    for start, line in edits.items():
        text, count = re.subn(rf"{re.escape(start)} .*?/>", line, text)
        assert count == 1
    path.write_text(text)
    commands = re.findall(r"^beacon-mj .*--templates my_doors.*$", section, re.M)
    listed, generated, crossed, _ = commands
    run(listed, tmp_path)
    run(generated, tmp_path)
    run(crossed.replace("-n 14", "-n 2 --workers 2"), tmp_path)
    rows = polars.read_parquet(tmp_path / "runs" / "mine" / "episodes.parquet")
    assert rows["success"].to_list() == [True, True]
    assert rows["suite"].to_list() == [None, None]
    scene = generate_scene("my_doors", 0, templates=tmp_path / "my_doors")
    found = scene.certificate.learning
    assert found
    assert found.worlds == 14
    assert found.value_s >= 3.0
    assert {p for row in found.parts[0].opens for p in row} == {0.05, 0.95}
    assert [len(stage.doors) for stage in found.parts[0].stages] == [4, 4, 4]
