"""Playing, pausing and scrubbing, and what a viewer draws, without a window."""

import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import BeaconError
from beacon_mj.recording import read_log
from beacon_mj.rendering import view_log, viewer
from beacon_mj.rendering.scrubber import (
    DOWN,
    END,
    HOME,
    LEFT,
    RIGHT,
    SPACE,
    UP,
    Scrubber,
)
from tests.recording.samples import record


def test_it_plays_in_real_time_and_stops_at_the_end() -> None:
    scrubber = Scrubber(30, 0.1)
    shown = []
    for _ in range(100):
        shown.append(scrubber.step)
        scrubber.advance(0.05)
    assert shown[:5] == [0, 0, 1, 1, 2]
    assert shown == sorted(shown)
    assert set(shown) == set(range(31))


def test_space_pauses_and_plays_on() -> None:
    scrubber = Scrubber(30, 0.1)
    scrubber.advance(0.5)
    scrubber.press(SPACE)
    scrubber.advance(9.0)
    assert (scrubber.step, scrubber.paused) == (5, True)
    scrubber.press(SPACE)
    scrubber.advance(0.2)
    assert (scrubber.step, scrubber.paused) == (7, False)


@pytest.mark.parametrize(
    ("keys", "step"),
    [
        ([RIGHT], 6),
        ([LEFT], 4),
        ([UP], 15),
        ([DOWN], 0),
        ([UP, UP, UP], 30),
        ([END], 30),
        ([HOME], 0),
        ([END, RIGHT, LEFT], 29),
        ([HOME, LEFT, RIGHT], 1),
        ([RIGHT] * 20, 25),
    ],
)
def test_keys_move_and_pause(keys: list[int], step: int) -> None:
    scrubber = Scrubber(30, 0.1)
    scrubber.advance(0.5)
    for key in keys:
        scrubber.press(key)
    scrubber.advance(1.0)
    assert (scrubber.step, scrubber.paused) == (step, True)


def test_every_step_can_be_reached_one_by_one() -> None:
    scrubber = Scrubber(997, 0.1)
    scrubber.press(HOME)
    for step in range(997):
        assert scrubber.step == step
        scrubber.press(RIGHT)


def test_playing_at_the_end_starts_again_and_other_keys_do_nothing() -> None:
    scrubber = Scrubber(30, 0.1)
    scrubber.press(ord("X"))
    assert (scrubber.step, scrubber.paused) == (0, False)
    scrubber.press(END)
    scrubber.press(SPACE)
    assert (scrubber.step, scrubber.paused) == (0, False)


class _Window:
    """Takes what the viewer gives a window."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.cam = mujoco.MjvCamera()
        self.user_scn = mujoco.MjvScene(model, 2000)
        self.texts: list[str] = []
        self.synced = 0

    def lock(self) -> Any:
        return nullcontext()

    def set_texts(self, texts: tuple[Any, Any, str, Any]) -> None:
        self.texts.append(texts[2])

    def sync(self) -> None:
        self.synced += 1


def test_a_frame_has_state_colours_marks_and_words(tmp_path: Path) -> None:
    live = record(tmp_path / "x.mcap", protocol=Protocol(max_steps=30))
    show = viewer._Show(read_log(tmp_path / "x.mcap"))
    window = _Window(show._model)
    show._draw(window, 0)
    before = show._model.geom_rgba.copy()
    marks = window.user_scn.ngeom
    show._draw(window, 30)
    base = show._data.body("base").xpos
    np.testing.assert_allclose(base[:2], live.steps[-1].outcome.position_m, atol=1e-9)
    assert np.abs(show._model.geom_rgba - before).max() > 0.1
    assert window.user_scn.ngeom > marks > 0
    assert "END: timeout" in window.texts[-1]
    assert "space: pause" in window.texts[-1]
    assert window.synced == 2


def test_without_a_display_it_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record(tmp_path / "x.mcap", protocol=Protocol(max_steps=2))
    monkeypatch.setattr(viewer, "mujoco", SimpleNamespace())
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(BeaconError, match=r"--html out.html"):
        view_log(tmp_path / "x.mcap")
