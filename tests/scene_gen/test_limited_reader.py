"""A user's templates cost bounded time and memory, and a crash is one line."""

import re
import shutil
import signal
import sys
from pathlib import Path

import pytest

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene_gen import family, limited_reader
from beacon_mj.scene_gen.family import Family, compile_family, load_family
from beacon_mj.scene_gen.mjcf_files import MAX_TOTAL_BYTES
from tests.scene_gen.test_user_mjcf import body, nominal, write

GEOM = '<geom size="0.2"/>'
#: What MuJoCo would take gigabytes or minutes for.
BOMBS = {
    "large plate": '<mesh name="m" builtin="plate" params="20000 20000"/>',
    "mesh of many facets": '<mesh name="m" builtin="supersphere" params="20000 1 1"/>',
}


@pytest.mark.skipif(sys.platform != "linux", reason="no such limits here")
@pytest.mark.parametrize("bomb", BOMBS)
def test_what_takes_too_much_is_one_line(bomb: str, tmp_path: Path) -> None:
    text = body("a", GEOM, head=f"<asset>{BOMBS[bomb]}</asset>")
    with pytest.raises(TemplateError, match=r"512 MiB|cannot compile") as caught:
        nominal(write(tmp_path, {"obstacles/a.xml": text}))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("boot", "message"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "with SIGSEGV"),
        ("while True: pass", "with SIG(XCPU|KILL)|within 5 s"),
        ("raise SystemExit(3)", "with status 3"),
        ("print('{}')", "no family"),
        ("print('nonsense')", "no answer from its process"),
        ("import time; time.sleep(60)", "no answer within 5 s"),
    ],
)
def test_a_process_that_dies_is_one_line(
    boot: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, {"obstacles/a.xml": body("a", GEOM)})
    limit = (
        "import sys; sys.path[:] = __import__('json').loads(sys.argv[-1])[0]\n"
        "from beacon_mj.process_limits import limit_effort; limit_effort(1, 10**6)\n"
    )
    monkeypatch.setattr(limited_reader, "_BOOT", limit + boot)
    monkeypatch.setattr(limited_reader, "WALL_S", 5.0)
    with pytest.raises(TemplateError, match=message) as caught:
        nominal(tmp_path)
    assert "\n" not in str(caught.value)


def test_shipped_families_and_copies_of_them_need_no_other_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path) -> bytes:
        raise AssertionError(path)

    monkeypatch.setattr(family, "read_apart", fail)
    assert load_family("sparse").prototypes
    shutil.copytree(ROOT, tmp_path / "copy")
    assert load_family("sparse", tmp_path / "copy").prototypes
    write(tmp_path, {"obstacles/a.xml": body("a", GEOM)})
    with pytest.raises(AssertionError):
        load_family("fam", tmp_path)


@pytest.mark.parametrize("name", ["sparse", "collision-required", "lookalike-doors"])
def test_a_family_is_the_same_from_another_process(name: str, tmp_path: Path) -> None:
    text = (ROOT / "families" / f"{name}.xml").read_text()
    (tmp_path / "own.xml").write_text(text.replace("<custom>", "<custom><!-- -->"))
    path = tmp_path / "own.xml"
    apart, here = load_family("own", tmp_path), compile_family(path)
    for part in Family.__slots__:
        assert getattr(apart, part) == getattr(here, part)
    assert load_family("own", tmp_path).prototypes == load_family(name).prototypes


def test_files_of_a_family_are_bounded_in_all(tmp_path: Path) -> None:
    count = MAX_TOTAL_BYTES // 60_000_000 + 1
    lines = "".join(f'<mesh name="m{k}" file="big.obj"/>' for k in range(count))
    text = body("a", GEOM, head=f"<asset>{lines}</asset>")
    write(tmp_path, {"obstacles/a.xml": text})
    with (tmp_path / "obstacles/big.obj").open("wb") as file:
        file.truncate(60_000_000)
    with pytest.raises(TemplateError, match=f"at most {MAX_TOTAL_BYTES} bytes in all"):
        nominal(tmp_path)


def test_a_flat_mesh_is_refused(tmp_path: Path) -> None:
    sheet = "0 0 0 1 0 0 0 1 0 1 1 0"
    head = f'<asset><mesh name="m" vertex="{sheet}" inertia="shell" '
    head += 'face="0 1 2 1 2 3"/></asset>'
    text = body("a", '<geom type="mesh" mesh="m"/>', head=head)
    with pytest.raises(TemplateError, match=r"one is flat|cannot compile it") as caught:
        nominal(write(tmp_path, {"obstacles/a.xml": text}))
    assert "\n" not in str(caught.value)


REFUSED = {
    "plugin of a default": (
        '<mujoco><default><default class="c"><plugin plugin="x"/></default></default>'
        "</mujoco>",
        "expected no <plugin> in <default>",
    ),
    "tuple": (
        '<mujoco><custom><tuple name="t"/></custom></mujoco>',
        "expected no <tuple> 't' in <custom>",
    ),
    "field of heights": (
        '<mujoco><asset><hfield name="h" nrow="9999" ncol="9999" size="1 1 1 1"/>'
        "</asset></mujoco>",
        "expected no <hfield> 'h' in <asset>",
    ),
    "plugin of a mesh": (
        '<mujoco><asset><mesh name="m"><plugin plugin="x"/></mesh></asset></mujoco>',
        "expected no <plugin> in <mesh>",
    ),
    "plugin of a body": (
        body("a", GEOM + '<plugin plugin="x"/>'),
        "expected no <plugin> in <body>",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_on_the_list_is_refused_by_name(case: str, tmp_path: Path) -> None:
    text, message = REFUSED[case]
    with pytest.raises(TemplateError, match=message):
        nominal(write(tmp_path, {"obstacles/a.xml": text}))


def test_a_color_that_is_none_is_refused(tmp_path: Path) -> None:
    write(tmp_path, {"obstacles/a.xml": body("a", GEOM)})
    text = (tmp_path / "fam.xml").read_text()
    found = re.search(r'(<default class="safe">.*?rgba=")([^"]*)', text, re.DOTALL)
    assert found is not None
    (tmp_path / "fam.xml").write_text(text.replace(found[0], f"{found[1]}2 0 0 1"))
    with pytest.raises(TemplateError, match="rgba"):
        load_family("fam", tmp_path)


def test_signals_have_names() -> None:
    assert limited_reader._name(-int(signal.SIGKILL)) == "SIGKILL"
    assert limited_reader._name(-60) in ("signal 60", "SIGRTMAX")
