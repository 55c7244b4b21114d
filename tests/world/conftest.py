"""Tests of what every world must do run over all of them."""

import pytest

from tests.worlds import WORLDS, Build


@pytest.fixture(params=[*WORLDS])
def build(request: pytest.FixtureRequest) -> Build:
    return WORLDS[request.param]
