"""Fixtures that several test modules share."""

import pytest
from hypothesis import settings

from tests.worlds import FAMILIES

# Compiling a kernel on its first call takes longer than hypothesis allows.
settings.register_profile("beacon", deadline=None, max_examples=60)
settings.load_profile("beacon")


@pytest.fixture(params=FAMILIES)
def family(request: pytest.FixtureRequest) -> str:
    return str(request.param)
