"""Fixtures that several test modules share."""

import os

import pytest
from hypothesis import settings

from tests.worlds import FAMILIES

# Tests neither read nor fill the user's cache of scenes.
os.environ["BEACON_MJ_CACHE"] = "off"

# Compiling a kernel on its first call takes longer than hypothesis allows.
settings.register_profile("beacon", deadline=None, max_examples=60)
# With CI set the examples are the same in every run: a failure is about the change.
settings.register_profile(
    "beacon-ci", settings.get_profile("beacon"), derandomize=True, database=None
)
settings.load_profile("beacon-ci" if os.environ.get("CI") else "beacon")


@pytest.fixture(params=FAMILIES)
def family(request: pytest.FixtureRequest) -> str:
    return str(request.param)
