"""Files are whole or absent, names are safe, and links to folders are followed."""

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.errors import BeaconError, LogError, RunError, one_line, printable
from beacon_mj.eval.runs.log_files import log_file
from beacon_mj.eval.runs.run_lock import LockedFile
from beacon_mj.files import file_name, files_below, replacing
from beacon_mj.recording import recover
from tests.recording.samples import PushThrough, record, scene_with_damage

NAMES = st.text(st.characters(codec=None), max_size=300)


@contextmanager
def largest_file(size_bytes: int) -> Iterator[None]:
    """Let no file grow beyond a size, as a disk does that becomes full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(b"old")
    with largest_file(10), pytest.raises(RunError, match=r"x\.json: cannot write"):
        with replacing(path, RunError) as part:
            part.write_bytes(bytes(1000))
    assert [p.name for p in tmp_path.iterdir()] == ["x.json"]
    assert path.read_bytes() == b"old"


def test_an_interrupt_leaves_nothing(tmp_path: Path) -> None:
    with suppress(KeyboardInterrupt), replacing(tmp_path / "x") as part:
        part.write_bytes(b"half")
        raise KeyboardInterrupt
    assert not [*tmp_path.iterdir()]


def test_a_link_stays_and_a_device_is_refused(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real" / "x")
    with replacing(tmp_path / "link") as part:
        part.write_bytes(b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real" / "x").read_bytes() == b"new"
    for path in (tmp_path, Path(os.devnull)):
        with pytest.raises(BeaconError, match="no regular file"), replacing(path):
            pass


def test_a_full_disk_cuts_no_row(tmp_path: Path) -> None:
    file = LockedFile(tmp_path / "lines")
    file.append(b"first\n")
    with largest_file(10), pytest.raises(RunError, match="cannot be written"):
        file.append(b"second line\n")
    assert (tmp_path / "lines").read_bytes() == b"first\n"
    file.append(b"second\n")
    file.close()
    assert (tmp_path / "lines").read_bytes() == b"first\nsecond\n"


def test_a_full_disk_leaves_no_recovered_log(tmp_path: Path) -> None:
    log = tmp_path / "x.mcap"
    record(log, scene_with_damage(), PushThrough())
    with largest_file(10_000), pytest.raises(LogError, match=r"y\.mcap: cannot write"):
        recover(log, tmp_path / "y.mcap")
    assert [p.name for p in tmp_path.iterdir()] == ["x.mcap"]
    assert recover(log, tmp_path / "y.mcap") > 0


@pytest.mark.parametrize(
    "name",
    [
        "", ".", "..", "../x", "/etc/passwd", "a\\b", "a\nb", "\x1b[31m", "nul", "a~b",
        "x" * 300, "-rf", " x", "x.", "a\u0308", "\udcff", "a\u202eb", "C:x",
    ],
)  # fmt: skip
def test_another_name_is_made_safe(name: str, tmp_path: Path) -> None:
    made = file_name(name)
    assert made != name
    assert made == Path(made).name
    assert made.isprintable()
    (tmp_path / made).touch()
    assert [p.name for p in tmp_path.iterdir()] == [made]
    log = log_file(tmp_path, name, name).resolve()
    assert log.parents[1] == tmp_path.resolve() / "logs"


@given(NAMES, NAMES)
def test_two_names_are_two_files(first: str, second: str) -> None:
    assert (file_name(first) == file_name(second)) == (first == second)
    assert file_name(first) not in ("", ".", "..")
    assert not {"/", "\0"} & {*file_name(first)}
    assert len(os.fsencode(file_name(first))) <= 200


def test_links_to_folders_are_followed_once(tmp_path: Path) -> None:
    run, elsewhere = tmp_path / "run", tmp_path / "elsewhere"
    run.mkdir()
    elsewhere.mkdir()
    (elsewhere / "a.mcap").touch()
    (elsewhere / "._a.mcap").touch()
    (run / "logs").symlink_to(elsewhere)
    (elsewhere / "round").symlink_to(run)
    assert files_below(run, ".mcap") == [run / "logs" / "a.mcap"]
    assert files_below(run / "logs", ".mcap") == [run / "logs" / "a.mcap"]


@given(st.text(st.characters(codec=None)))
def test_nothing_but_what_can_be_printed_is_shown(text: str) -> None:
    shown = printable(text)
    assert all(line.isprintable() for line in shown.split("\n"))
    assert shown.count("\n") == text.count("\n")
    assert printable(shown) == shown
    assert one_line(text).isprintable()
    shown.encode()
