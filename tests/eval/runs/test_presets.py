"""Presets of the protocol, as settings and on the command line."""

import pytest

from beacon_mj import cli
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import RunError
from beacon_mj.eval.runs.experiment import single_planner
from beacon_mj.eval.runs.presets import with_preset
from beacon_mj.eval.studies.regret import regret_runs


@pytest.mark.parametrize("name", ["paper", "realistic"])
def test_settings_of_a_preset_make_its_protocol(name: str) -> None:
    found = single_planner("beacon", with_preset(name, ()))
    assert found.protocol == Protocol.preset(name)
    assert with_preset(None, ["a.b=1"]) == ["a.b=1"]


def test_what_the_user_sets_goes_on_top() -> None:
    settings = with_preset("realistic", {"protocol.pose_noise_m": 0.03})
    protocol = single_planner("beacon", settings).protocol
    assert protocol.pose_noise_m == 0.03
    assert protocol.occlusion is True


def test_regret_is_measured_under_a_preset() -> None:
    runs, _ = regret_runs(
        "beacon", with_preset("realistic", ()), ("sparse",), scenes_per_family=1
    )
    assert runs["near"].protocol == Protocol.preset("realistic")
    assert runs["told"].protocol == Protocol.preset("realistic").certain()


def test_an_unknown_preset_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RunError, match="'hard'"):
        with_preset("hard", ())
    for command in ("eval", "sweep", "ablate", "regret"):
        line = [command, "--planner", "beacon", "--protocol", "realistc"]
        assert cli.run(line) == 2
        error = capsys.readouterr().err.strip()
        assert "\n" not in error
        assert "'realistc'" in error
        assert "realistic" in error
