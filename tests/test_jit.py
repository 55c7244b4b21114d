"""Kernels work where nothing can be written: read-only installations, full disks."""

import os
import stat
import subprocess
import sys
from pathlib import Path

KERNEL = "from beacon_mj.jit import kernel\n@kernel\ndef twice(x):\n    return 2 * x\n"
FULL = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)); "


def call(folder: Path, code: str, **environment: str) -> str:
    """Run code beside a module `mine`, whose folder takes no machine code."""
    folder.mkdir()
    (folder / "mine.py").write_text(KERNEL)
    (folder / "__pycache__").touch()  # No folder, so that root cannot write to it.
    usual = {k: v for k, v in os.environ.items() if not k.startswith(("XDG", "NUMBA"))}
    done = subprocess.run(
        [sys.executable, "-B", "-c", f"{code}; import mine; print(mine.twice(21))"],
        env=usual | {"PYTHONPATH": f"{folder}:{os.getcwd()}", "HOME": os.devnull}
        | environment,
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout.strip()


def test_without_a_home_machine_code_goes_to_a_private_folder(tmp_path: Path) -> None:
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    assert call(tmp_path / "code", "pass", TMPDIR=str(temporary)) == "42"
    [private] = temporary.iterdir()
    assert stat.S_IMODE(private.stat().st_mode) == 0o700
    assert [*private.rglob("*.nbc")]


def test_a_folder_that_others_can_write_to_is_not_used(tmp_path: Path) -> None:
    private = tmp_path / "tmp" / f"beacon-mj-{os.getuid()}"
    private.mkdir(parents=True)
    private.chmod(0o777)
    assert call(tmp_path / "code", "pass", TMPDIR=str(tmp_path / "tmp")) == "42"
    assert not [*private.iterdir()]


def test_a_full_disk_costs_the_cache_alone(tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    assert call(tmp_path / "code", FULL + "pass", NUMBA_CACHE_DIR=cache) == "42"
