"""The Gymnasium environments: both checkers, equal rows, and what `info` holds."""

import subprocess
import sys
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import beacon_mj
from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import BeaconError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.scene_gen.suites import RELEASED
from tests.repository import REPOSITORY
from tests.rl.policies import Straight, straight

gymnasium = pytest.importorskip("gymnasium", reason="no Gymnasium here")
from beacon_mj.gym import ENV_IDS, NavigationEnv  # noqa: E402

SHORT = Protocol(max_steps=40)
#: Making a room of 2,000 obstacles takes long.
FAMILIES = [
    pytest.param(name, marks=[pytest.mark.slow] if name in RELEASED["scale-v1"] else [])
    for name in ENV_IDS
]
COUNT = 8  #: Scenes that are run alone and in vectors.
ID = "beacon_mj.gym:beacon_mj/cluttered-v1"


def timeless(row: Row) -> dict[str, Any]:
    """Return the columns of a row that must be equal."""
    return {k: v for k, v in row.as_dict().items() if k not in WALL_CLOCK_COLUMNS}


def finish(env: Any, **reset: Any) -> dict[str, Any]:
    """Drive an episode straight at the goal; return its row."""
    observation, _ = env.reset(**reset)
    over = False
    while not over:
        observation, _, ended, cut, info = env.step(straight(observation))
        over = ended or cut
    return timeless(info["row"])


@pytest.fixture(scope="module")
def alone() -> list[dict[str, Any]]:
    """Rows of each scene, run one after the other in one environment."""
    env = gymnasium.make(ID, protocol=SHORT)
    return [finish(env) for _ in range(COUNT)]


def test_every_released_family_has_an_id() -> None:
    families = [name for families in RELEASED.values() for name in families]
    assert [*ENV_IDS] == families
    assert ENV_IDS["lookalike-doors-08"] == "beacon_mj/lookalike-doors-08-v1"
    for family, name in ENV_IDS.items():
        assert gymnasium.spec(name).kwargs == {"family": family}


@pytest.mark.parametrize("family", FAMILIES)
def test_gymnasium_has_no_complaint(family: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(ENV_IDS[family], disable_env_checker=True)
    check_env(env.unwrapped, skip_render_check=True)


#: It prefers one axis; its `MultiInputPolicy` flattens the table of obstacles itself.
@pytest.mark.filterwarnings("ignore:Your observation obstacles has an unconventional")
@pytest.mark.parametrize("family", FAMILIES)
def test_stable_baselines_has_no_complaint(family: str) -> None:
    checker = pytest.importorskip(
        "stable_baselines3.common.env_checker", reason="no Stable-Baselines3 here"
    )
    checker.check_env(gymnasium.make(ENV_IDS[family]).unwrapped)


def test_the_picture_is_one() -> None:
    env = gymnasium.make(ENV_IDS["cluttered"], render_mode="rgb_array")
    env.reset()
    before = env.unwrapped._episodes.episode.world.model.geom_size.copy()
    try:
        picture = env.render()
    except beacon_mj.rendering.gl.RenderError as error:
        pytest.skip(str(error))
    assert picture.shape == (520, 600, 3)
    assert picture.std() > 10.0
    assert np.array_equal(env.unwrapped._episodes.episode.world.model.geom_size, before)


def test_rows_are_those_of_an_evaluation(
    alone: list[dict[str, Any]], tmp_path: Path
) -> None:
    results = beacon_mj.evaluate(
        {"policy": Straight},
        families=["cluttered"],
        scenes_per_family=COUNT,
        seed=1000,
        protocol=SHORT,
        workers=1,
        log="none",
        report=False,
        out=tmp_path / "run",
    )
    rows = [timeless(row) for row in results.episodes]
    assert rows == alone
    assert any(row["contacts"] for row in rows)
    assert {row["suite"] for row in rows} == {"paper-v1"}


def test_rows_are_the_same_in_any_order(alone: list[dict[str, Any]]) -> None:
    env = gymnasium.make(ID, protocol=SHORT)
    for index in (5, 0, 7, 5):
        assert finish(env, options={"index": index}) == alone[index]
    assert finish(env) == alone[0]
    assert finish(env, seed=7) != alone[0]
    assert finish(env, seed=1000) == alone[0]


@pytest.mark.parametrize("count", [1, 2, 8])
@pytest.mark.parametrize("kind", ["sync", "async"])
def test_rows_are_the_same_in_vectors(
    kind: str, count: int, alone: list[dict[str, Any]]
) -> None:
    makers = [
        partial(gymnasium.make, ID, protocol=SHORT, indices=range(k, COUNT, count))
        for k in range(count)
    ]
    if kind == "sync":
        env = gymnasium.vector.SyncVectorEnv(makers)
    else:
        env = gymnasium.vector.AsyncVectorEnv(makers, context="spawn")
    rows: dict[int, dict[str, Any]] = {}
    try:
        observation, _ = env.reset()
        while len(rows) < COUNT:
            each = [
                straight({name: array[k] for name, array in observation.items()})
                for k in range(count)
            ]
            observation, _, _, _, info = env.step(np.array(each, np.float32))
            for row in info.get("row", ()):
                if isinstance(row, Row):
                    rows.setdefault(row.scene_index, timeless(row))
    finally:
        env.close()
    assert [rows[index] for index in sorted(rows)] == alone


def test_logs_are_those_of_an_evaluation(tmp_path: Path) -> None:
    env = gymnasium.make(ID, protocol=SHORT, log_dir=tmp_path / "logs")
    row = finish(env)
    [log] = (tmp_path / "logs").glob("*.mcap")
    assert log.stem == "cluttered_0000"
    assert timeless(beacon_mj.measure_log(log).row) == row
    assert beacon_mj.verify(log).ok


def test_a_reset_says_which_scene_it_is_of() -> None:
    env = gymnasium.make(ENV_IDS["sparse"])
    _, info = env.reset(seed=3, options={"index": 4})
    assert info == {"family": "sparse", "index": 4, "seed": 3}
    assert env.unwrapped.task.max_steps == 1000
    assert env.unwrapped.observation.step == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"idx": 1}, r"option of reset\(\) 'idx'. Did you mean 'index'"),
        ({"index": -1}, "index"),
    ],
)
def test_bad_options_of_reset_are_refused(
    options: dict[str, Any], message: str
) -> None:
    env = NavigationEnv("sparse")
    with pytest.raises(BeaconError, match=message):
        env.reset(options=options)


def test_a_bad_render_mode_is_refused() -> None:
    with pytest.raises(BeaconError, match="Unknown render mode 'human'"):
        NavigationEnv("sparse", render_mode="human")


def test_nothing_is_seen_before_the_first_reset() -> None:
    with pytest.raises(BeaconError, match=r"Expected reset\(\) before"):
        _ = NavigationEnv("sparse").task


def test_the_core_does_not_import_it() -> None:
    code = (
        "import sys, beacon_mj\n"
        "for name in beacon_mj.__all__: getattr(beacon_mj, name)\n"
        "bad = {'gymnasium', 'dm_env', 'dm_control', 'torch'} & set(sys.modules)\n"
        "sys.exit(f'imported {bad}' if bad else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True
    )
    assert done.returncode == 0, done.stderr


def test_without_gymnasium_one_line_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "import beacon_mj\ntry:\n    import beacon_mj.gym\n"
        "except beacon_mj.BeaconError as error:\n    print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True
    )
    assert done.stderr == ""
    assert "expected package 'gymnasium' but it is not installed" in done.stdout


def test_importing_it_twice_warns_of_nothing() -> None:
    import importlib

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        importlib.reload(beacon_mj.gym)
