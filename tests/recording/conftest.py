"""One recorded episode for all recording tests."""

from pathlib import Path
from typing import NamedTuple

import pytest

from beacon_mj.episode.trace import Trace
from tests.recording.samples import record, scene_with_damage


class Sample(NamedTuple):
    path: Path
    trace: Trace


@pytest.fixture(scope="session")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """A push through a barrier."""
    path = tmp_path_factory.mktemp("logs") / "sample.mcap"
    return Sample(path, record(path))


@pytest.fixture(scope="session")
def damage(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """A run in which something breaks."""
    path = tmp_path_factory.mktemp("logs") / "damage.mcap"
    return Sample(path, record(path, scene_with_damage()))
