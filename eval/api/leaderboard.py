"""A page of submissions, each verified before it is listed."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from beacon_mj.errors import BeaconError, RunError
from beacon_mj.eval.api.verification import Verified, verify
from beacon_mj.eval.report.leaderboard import Line, Refused, render_leaderboard
from beacon_mj.eval.runs.run_folder import load_config, load_rows
from beacon_mj.eval.verification.submissions import lines_of
from beacon_mj.eval.verification.unpack import is_bundle, unpack
from beacon_mj.files import replacing

PAGE = "index.html"
MOST = 3  #: Problems of a refused submission that are shown.


@dataclass(frozen=True, kw_only=True, slots=True)
class Leaderboard:
    """What came of the submissions.

    Attributes:
        path: The page.
        lines: A line for each planner and suite of those that hold.
        refused: Those that do not.
    """

    path: Path
    lines: tuple[Line, ...]
    refused: tuple[Refused, ...]

    @property
    def ok(self) -> bool:
        """Whether every submission holds."""
        return not self.refused

    @property
    def problems(self) -> list[str]:
        """A line for each thing that does not hold."""
        return [f"{e.submission}: {text}" for e in self.refused for text in e.problems]


def leaderboard(
    bundles: Sequence[str | Path],
    out: str | Path,
    *,
    rerun: bool = False,
    fresh_seed: int | None = None,
    scenes_per_family: int | None = None,
    trust_code: bool = False,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Leaderboard:
    """Verify bundles and write a static page of those that hold.

    The same as `beacon-mj leaderboard`. The page needs no network and has no script;
    those that do not hold are named on it with their first problems.

    Args:
        bundles: Files that `bundle` wrote, whoever did it.
        out: Folder of the page, `index.html`; made when missing.
        rerun: See `verify`; so are the others.
        fresh_seed: Seed of unseen scenes.
        scenes_per_family: How many of those.
        trust_code: Whether the submissions' own planners may run.
        workers: Processes.
        tell: Told which submission is verified next.

    Raises:
        RunError: If there is no bundle, or two have one file name.
    """
    paths = [Path(each) for each in bundles]
    names = [path.name for path in paths]
    if not names or len({*names}) < len(names):
        raise RunError("Expected bundles with file names of their own.")
    check = partial(
        verify,
        workers=workers,
        rerun=rerun,
        fresh_seed=fresh_seed,
        scenes_per_family=scenes_per_family,
        trust_code=trust_code,
    )
    lines, refused = list[Line](), list[Refused]()
    for path in paths:
        tell(path.name)
        try:
            lines += _verified(path, check)
        except BeaconError as error:
            refused.append(_refused(path, str(error).split("\n")))
    target = Path(out) / PAGE
    with replacing(target) as part:
        part.write_text(render_leaderboard(lines, refused), encoding="utf-8")
    return Leaderboard(path=target, lines=tuple(lines), refused=tuple(refused))


def _verified(path: Path, check: Callable[[Path], Verified]) -> list[Line]:
    """Return the lines of a bundle that holds; raise its problems otherwise."""
    if not is_bundle(path):
        raise RunError(f"{path}: expected a bundle, which beacon-mj bundle writes.")
    found = check(path)
    if not found.ok:
        raise RunError("\n".join(found.problems))
    with tempfile.TemporaryDirectory(prefix="beacon-mj-") as folder:
        run = unpack(path, Path(folder))
        return lines_of(path.name, load_config(run), load_rows(run), found.checks)


def _refused(path: Path, problems: Sequence[str]) -> Refused:
    """Return why a bundle is not listed; where it lies here is nobody's business."""
    told = [text.replace(str(path), path.name) for text in problems]
    if (more := len(told) - MOST) > 0:
        told = [*told[:MOST], f"and {more} more"]
    return Refused(path.name, tuple(told))
