"""Layouts of a template folder and of packages: found, hashed, and kept apart."""

import sys
from pathlib import Path

import pytest

from beacon_mj.errors import TemplateError
from beacon_mj.eval.runs.config import generated_scenes, scene_refs
from beacon_mj.eval.runs.experiment import experiment
from beacon_mj.eval.runs.lineup import planner_entries
from beacon_mj.eval.runs.scene_cache import VARIABLE, cached_scene
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.family import family_sha256
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.layouts import LAYOUTS

LINE = """
from beacon_mj.scene_gen.layouts import at, layout


@layout("line")
def line(sampler, start, goal):
    template = sampler.obstacle(sampler.shape(), "movable", fixed=False)
    return [at(template, (3.0, Y), 0.0)]
"""


def folder_with(folder: Path, source: str | None, name: str = "line") -> Path:
    folder.mkdir(exist_ok=True)
    text = (ROOT / "families" / "sparse.xml").read_text()
    old = '"layout" data="scatter"'
    assert old in text
    (folder / "mine.xml").write_text(text.replace(old, f'"layout" data="{name}"'))
    if source is not None:
        (folder / "layouts.py").write_text(source)
    return folder


def heights(scene: Scene) -> list[float]:
    return [o.y_m for o in scene.obstacles]


def test_two_folders_may_call_a_layout_the_same(tmp_path: Path) -> None:
    low = folder_with(tmp_path / "low", LINE.replace("Y", "1.0"))
    high = folder_with(tmp_path / "high", LINE.replace("Y", "5.0"))
    for _ in range(2):
        assert heights(generate_scene("mine", 0, templates=low)) == [1.0]
        assert heights(generate_scene("mine", 0, templates=high)) == [5.0]
    assert "line" not in LAYOUTS


def test_an_edited_layout_makes_other_scenes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    folder = folder_with(tmp_path / "mine", LINE.replace("Y", "1.0"))
    before = family_sha256("mine", folder)
    assert heights(cached_scene("mine", 0, 0, "noisy", folder)) == [1.0]
    assert heights(cached_scene("mine", 0, 0, "noisy", folder)) == [1.0]
    (folder / "layouts.py").write_text(LINE.replace("Y", "5.0"))
    assert family_sha256("mine", folder) != before
    assert heights(cached_scene("mine", 0, 0, "noisy", folder)) == [5.0]
    entries = [p for p in (tmp_path / "cache").rglob("*") if p.is_file()]
    assert len(entries) == 2


def test_hashing_a_family_runs_nothing(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "mine", "raise SystemExit('it ran')")
    assert family_sha256("mine", folder) != family_sha256("sparse")
    generate_scene("sparse", 0)
    with pytest.raises(TemplateError, match=r"layouts.py:1: .*it ran"):
        generate_scene("mine", 0, templates=folder)


def test_a_run_of_others_is_described_without_running_its_layouts(
    tmp_path: Path,
) -> None:
    """Merging shards, for one, looks up the scenes of a run that it did not begin."""
    folder = folder_with(tmp_path / "mine", LINE.replace("Y", "1.0"))
    entries, protocol = planner_entries(["bug1"], [])
    config, refs = experiment(
        entries, protocol,
        families=["mine"], scenes_per_family=2, seed=0, perception="noisy",
        templates=folder,
    )  # fmt: skip
    (folder / "layouts.py").write_text("raise SystemExit('it ran')")
    hashes, again = scene_refs(config)
    assert again == refs
    assert hashes != config.families


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("import nowhere_to_be_found\n", r"layouts.py:1: cannot import the layouts: "
         r"ModuleNotFoundError: No module named 'nowhere_to_be_found'"),
        ("\n\nx = 1 / 0\n", r"layouts.py:3: .*ZeroDivisionError: division by zero"),
        ("x = 1\ndef f(:\n", r"layouts.py:2: .*SyntaxError"),
        ("raise ValueError('two\\nlines')", r"layouts.py:1: .*two lines"),
        (LINE.replace("line", "lime"), r"Unknown layout 'line'. Did you mean 'lime'\?"),
        (LINE.replace('"line"', '"scatter"'), "'scatter' is shipped"),
        (LINE.replace('"line"', '"bays"'), "'bays' is shipped"),
        (LINE.replace("Y", "sampler.nothing"), r"layouts.py:8: the layout failed: "
         "AttributeError"),
        (LINE.replace("return [", "return 3, ["), "to return a list of obstacles but"),
        (None, r"Unknown layout 'line'\. .*Available: barrier"),
    ],
)  # fmt: skip
def test_bad_layouts_are_one_line(
    source: str | None, message: str, tmp_path: Path
) -> None:
    folder = folder_with(tmp_path / "mine", source and source.replace("Y", "1.0"))
    with pytest.raises(TemplateError, match=message) as caught:
        generate_scene("mine", 0, templates=folder)
    assert "\n" not in str(caught.value)


def test_a_package_brings_layouts_by_entry_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The form in which pip installs a package; its source is in the hash."""
    site = tmp_path / "site"
    (site / "others-1.0.dist-info").mkdir(parents=True)
    (site / "others-1.0.dist-info" / "METADATA").write_text("Name: others\n")
    (site / "others-1.0.dist-info" / "entry_points.txt").write_text(
        "[beacon_mj.layouts]\nline = others_layouts:line\n"
    )
    module = site / "others_layouts.py"
    module.write_text(LINE.replace("Y", "2.0"))
    monkeypatch.syspath_prepend(str(site))
    folder = folder_with(tmp_path / "mine", None)
    before = family_sha256("mine", folder)
    assert "others_layouts" not in sys.modules
    try:
        assert heights(generate_scene("mine", 0, templates=folder)) == [2.0]
    finally:
        sys.modules.pop("others_layouts", None)
    module.write_text(LINE.replace("Y", "2.5"))
    assert family_sha256("mine", folder) != before
    assert "line" not in LAYOUTS


def test_a_learning_family_does_not_hide_that_its_folder_is_no_good(
    tmp_path: Path,
) -> None:
    shipped = ROOT / "families" / "revisited-rooms.xml"
    (tmp_path / "mine.xml").write_bytes(shipped.read_bytes())
    assert generated_scenes(["mine"], 3, tmp_path)[1]
    (tmp_path / "layouts.py").write_text(LINE.replace('"line"', '"bays"'))
    with pytest.raises(TemplateError, match=r"'bays' is shipped"):
        generated_scenes(["mine"], 3, tmp_path)
