"""Reading a user's family in a process of its own, with limits.

MuJoCo compiles what a stranger may have written: its C code meets pictures, meshes and
sizes of any kind. Here that costs bounded time and memory, and a crash is one line. The
shipped families, and unchanged copies of them, are read in this process.
"""

import json
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import msgspec

from beacon_mj.errors import TemplateError, describe
from beacon_mj.process_limits import limit_effort, limit_memory

MEMORY_MIB = 512  #: Address space beyond what the interpreter takes.
CPU_S = 20  #: Processor time.
WALL_S = 120.0  #: Time by the clock, on a machine that does other things as well.
MAX_BYTES = 32_000_000  #: Of the answer.
_BOOT = """
import json, sys
sys.path[:], path = json.loads(sys.argv.pop())
from beacon_mj.scene_gen.limited_reader import main
main(path)
"""


class Answer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What came of reading a family: its data as JSON, or what is wrong with it."""

    family: msgspec.Raw = msgspec.Raw(b"")
    error: str = ""


def read_apart(path: Path) -> bytes:
    """Return a family as `beacon_mj.scene_gen.family.to_json` writes it.

    Raises:
        TemplateError: If it cannot be read, or not within the limits.
    """
    with TemporaryFile() as out:
        status = _run(path, out)
        out.seek(0)
        text = out.read(MAX_BYTES)
    if status != 0:
        raise TemplateError(
            f"{path}: expected templates that MuJoCo compiles with {MEMORY_MIB} MiB in "
            f"{CPU_S} s but its process ended with {_name(status)}."
        )
    try:
        answer = msgspec.json.decode(text, type=Answer)
    except msgspec.MsgspecError as error:
        raise TemplateError(f"{path}: no answer from its process: {error}.") from error
    if answer.error:
        raise TemplateError(answer.error)
    return bytes(answer.family)


def _run(path: Path, out: IO[bytes]) -> int | None:
    """Return the status of the process; None if it took too long."""
    boot = json.dumps([sys.path, str(path)])
    try:
        return subprocess.run(
            [sys.executable, "-c", _BOOT, boot],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.DEVNULL,
            timeout=WALL_S,
            check=False,
        ).returncode
    except subprocess.TimeoutExpired:
        return None
    except OSError as error:
        raise TemplateError(
            f"{path}: cannot start a process to read it: {error.strerror}."
        ) from error


def _name(status: int | None) -> str:
    if status is None:
        return f"no answer within {WALL_S:g} s"
    if status < 0:
        known = {int(s): s.name for s in signal.Signals}
        return known.get(-status, f"signal {-status}")
    return f"status {status}"


def main(path: str) -> None:
    """Read a family and write the answer to the standard output; runs in the child."""
    import scipy.spatial  # noqa: F401  Hulls need it; it is no memory of the family's.

    from beacon_mj.scene_gen.family import compile_family, to_json

    sys.stdout.flush()
    limit_memory(MEMORY_MIB)
    limit_effort(CPU_S, MAX_BYTES)
    try:
        answer = Answer(family=msgspec.Raw(to_json(compile_family(Path(path)))))
    except TemplateError as error:
        answer = Answer(error=str(error))
    except MemoryError:
        answer = Answer(
            error=f"{path}: expected templates that MuJoCo compiles with {MEMORY_MIB} "
            "MiB but they need more."
        )
    except Exception as error:
        # MuJoCo reports memory that it did not get as an unknown exception.
        answer = Answer(
            error=f"{path}: cannot be read with {MEMORY_MIB} MiB: {describe(error)}."
        )
    sys.stdout.buffer.write(msgspec.json.encode(answer))
    sys.stdout.flush()
