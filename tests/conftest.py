"""Fixtures that several test modules share."""

import pytest

from tests.worlds import FAMILIES


@pytest.fixture(params=FAMILIES)
def family(request: pytest.FixtureRequest) -> str:
    return str(request.param)
