"""Suites: what was released stays as it was, and nothing else carries its name."""

import platform
import shutil
from pathlib import Path

import pytest

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene_gen.family import family_paths, family_sha256, load_family
from beacon_mj.scene_gen.learning.rounds import (
    cut_round,
    default_scenes,
    round_scenes,
)
from beacon_mj.scene_gen.suites import (
    RELEASED,
    chosen_families,
    sample_sha256,
    stated_suite,
    suite_families,
    suite_of,
)

FAMILIES = [(suite, name) for suite, own in RELEASED.items() for name in own]
#: The same, those marked whose scenes take half a minute each.
SAMPLED = [
    pytest.param(*each, marks=pytest.mark.slow if each[1] == "warehouse-48" else ())
    for each in FAMILIES
]


@pytest.mark.skipif(
    platform.system() != "Linux" or platform.machine() != "x86_64",
    reason="scenes are the same bits on x86-64 Linux",
)
@pytest.mark.parametrize(("suite", "family"), SAMPLED)
def test_the_scenes_of_a_released_suite_do_not_change(suite: str, family: str) -> None:
    release = RELEASED[suite][family]
    same = sample_sha256(family) == release.scenes
    assert same, (
        f"{family}: its scenes are no longer those that were released with {suite}. "
        "Results on them are published: put them back as they were, or give the new "
        "scenes a family of a new name in a new version of the suite, and list it in "
        "RELEASED of scene_gen/suites.py beside the old one."
    )
    assert family_sha256(family) == release.files, (
        f"{family}: its files were edited, its sample scenes are the same. If all "
        "scenes are, put the new SHA-256 of its files into RELEASED of "
        f"scene_gen/suites.py: {family_sha256(family)}."
    )


def test_every_shipped_family_is_of_the_suite_that_its_file_names() -> None:
    assert {name for _, name in FAMILIES} == {*family_paths()}
    for suite, name in FAMILIES:
        assert load_family(name).suite == suite
        assert suite_of(name) == suite


def copied(folder: Path, family: str, name: str, **changes: str) -> None:
    text = (ROOT / "families" / f"{family}.xml").read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    (folder / f"{name}.xml").write_text(text)


def test_a_copy_is_not_believed_to_be_what_it_says(tmp_path: Path) -> None:
    copied(tmp_path, "lookalike-doors", "mine")
    copied(tmp_path, "cluttered", "cluttered", Dense="Crowded")
    assert load_family("mine", tmp_path).suite == "learning-v1"
    assert suite_of("mine", tmp_path) is None
    assert stated_suite("mine", tmp_path) is None
    assert suite_of("cluttered", tmp_path) is None  # Another file of the same name.
    assert suite_of("sparse", tmp_path) == "paper-v1"
    assert "mine" not in suite_families("learning-v1", tmp_path)
    shutil.copy(ROOT / "families" / "cluttered.xml", tmp_path / "cluttered.xml")
    assert suite_of("cluttered", tmp_path) == "paper-v1"  # The very same scenes.


def test_layouts_of_ones_own_make_another_family(tmp_path: Path) -> None:
    shutil.copy(ROOT / "families" / "cluttered.xml", tmp_path / "cluttered.xml")
    (tmp_path / "layouts.py").write_text("")
    assert suite_of("cluttered", tmp_path) is None


def test_suites_name_their_families_and_all_is_everything(tmp_path: Path) -> None:
    assert {*suite_families("paper-v1")} == {*RELEASED["paper-v1"]}
    assert {*chosen_families((), ("all",))} == {*family_paths()}
    assert {*chosen_families((), ())} == {*RELEASED["paper-v1"]}
    both = chosen_families((), ("hard-v1", "paper-v1", "hard-v1"))
    assert both[:2] == ["hard-required", "hard-shortcut"]
    assert len(both) == 6
    said = {'name="suite" data="learning-v1"': 'name="suite" data="mine-v1"'}
    copied(tmp_path, "lookalike-doors", "mine", **said)
    assert suite_families("mine-v1", tmp_path) == ["mine"]
    assert "mine" in suite_families("all", tmp_path)
    with pytest.raises(TemplateError, match=r"Unknown suite 'mine'.*mine-v1"):
        suite_families("mine", tmp_path)
    with pytest.raises(TemplateError, match="expected no --family beside it"):
        chosen_families(("sparse",), ("paper-v1",))


def test_a_run_holds_the_whole_rounds_nearest_to_100() -> None:
    rounds = {n: round_scenes(load_family(n)) for _, n in FAMILIES}
    assert {n for n, length in rounds.items() if length == 1} == {
        *RELEASED["paper-v1"], *RELEASED["hard-v1"], *RELEASED["scale-v1"],
    }  # fmt: skip
    assert rounds["lookalike-doors-shuffled"] == 6
    assert rounds["unweighed-doors-redrawn"] == 10
    assert rounds["revisited-rooms"] == rounds["revisited-rooms-redrawn"] == 90
    for _, name in FAMILIES:
        family = load_family(name)
        count = default_scenes(family)
        assert count % rounds[name] == 0
        assert abs(count - 100) <= rounds[name] / 2
    assert default_scenes(load_family("lookalike-doors"), 10) == 12
    assert default_scenes(load_family("revisited-rooms"), 10) == 90


def test_worlds_that_are_drawn_one_by_one_make_no_rounds(tmp_path: Path) -> None:
    prior = {'name="kind_prior" data="0.5"': 'name="kind_prior" data="0.7"'}
    copied(tmp_path, "lookalike-doors", "mine", **prior)
    assert round_scenes(load_family("mine", tmp_path)) == 1
    copied(tmp_path, "revisited-rooms", "rooms", **prior)
    rooms = load_family("rooms", tmp_path)
    assert round_scenes(rooms) == 3  # A whole mission, at least.
    assert default_scenes(rooms) == 99


def test_a_round_that_is_cut_is_said() -> None:
    assert cut_round("a", 12, 6) is None
    assert cut_round("a", 7, 1) is None
    assert "a: 20 scenes cut a round of 6" in str(cut_round("a", 20, 6))
    assert "18 or 24 would be whole rounds" in str(cut_round("a", 20, 6))
    assert "; 90 would be" in str(cut_round("a", 20, 90))
