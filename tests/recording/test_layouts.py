"""The layouts name topics, fields and panels that exist."""

import json
import math
import re
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from beacon_mj.errors import LogError
from beacon_mj.recording.layouts import ROOT, VIEWERS, write_layouts
from beacon_mj.recording.messages import message
from beacon_mj.recording.schemas import TOPICS

#: The viewer's own panels: their type in a layout, and their config in foxglove-sdk.
PANELS = {
    "3D": "ThreeDeeConfig",
    "Plot": "PlotConfig",
    "RawMessages": "RawMessagesConfig",
    "RosOut": "LogConfig",
    "StateTransitions": "StateTransitionsConfig",
    "Table": "TableConfig",
}
OLDER = {"publish", "imageMode", "legendDisplay"}


@pytest.fixture(params=VIEWERS)
def viewer(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def layout(viewer: str) -> dict[str, Any]:
    return dict(json.loads((ROOT / f"{viewer}.json").read_text()))


def _leaves(node: Any) -> list[str]:
    """Return the panels of a tree, checking each split."""
    if isinstance(node, str):
        return [node]
    assert node.keys() == {"direction", "first", "second", "splitPercentage"}
    assert node["direction"] in ("row", "column")
    assert 0 < node["splitPercentage"] < 100
    return _leaves(node["first"]) + _leaves(node["second"])


def test_every_panel_is_placed_once_and_configured(
    layout: dict[str, Any], viewer: str
) -> None:
    assert {"configById", "layout", "globalVariables", "userNodes"} <= layout.keys()
    panels = _leaves(layout["layout"])
    assert sorted(panels) == sorted(layout["configById"])
    assert {p.split("!")[0] for p in panels} == set(PANELS)
    for config in layout["configById"].values():
        assert config[f"{viewer}PanelTitle"]


def test_configurations_are_those_of_foxglove(
    layout: dict[str, Any], viewer: str
) -> None:
    theirs = pytest.importorskip("foxglove.layouts")
    for panel, config in layout["configById"].items():
        known = getattr(theirs, PANELS[panel.split("!")[0]])()._to_dict().keys()
        assert config.keys() - known - OLDER <= {f"{viewer}PanelTitle"}, panel


def _field(descriptor: Any, path: str) -> Any:
    """Return the last field of a path such as `contacts[:].force_n.x`."""
    field = None
    for name in re.sub(r"\[:\]", "", path).split("."):
        field = descriptor.fields_by_name[name]
        descriptor = field.message_type
    return field


def _paths(config: dict[str, Any]) -> list[str]:
    return [
        *(path["value"] for path in config.get("paths", ())),
        *filter(None, [config.get("topicPath"), config.get("topicToRender")]),
        *config.get("topics", {}),
    ]


def test_every_path_leads_to_a_field_of_a_topic(layout: dict[str, Any]) -> None:
    used = set()
    for panel, config in layout["configById"].items():
        for path in _paths(config):
            topic = max((t for t in TOPICS if path.startswith(t)), key=len)
            used.add(topic)
            rest = path[len(topic) :].removeprefix(".")
            if rest:
                field = _field(message(TOPICS[topic]).DESCRIPTOR, rest)
                numeric = field.cpp_type not in (
                    field.CPPTYPE_STRING,
                    field.CPPTYPE_MESSAGE,
                )
                assert numeric or not panel.startswith("Plot")
    assert TOPICS.keys() - used == {
        *("/tf", "/tf/start", "/tf/moved"),  # In use by every 3-D panel, unnamed.
        *("/belief", "/command", "/sensed", "/state", "/told", "/turn"),
    }


def test_bars_are_of_fields_that_always_have_a_value(layout: dict[str, Any]) -> None:
    """Where a field is absent, the bar before goes on to the next value."""
    for path in _paths(layout["configById"]["StateTransitions!action"]):
        topic, _, name = path.partition(".")
        field = _field(message(TOPICS[topic]).DESCRIPTOR, name)
        assert not field.has_presence, path


def test_nothing_hides_what_is_drawn(layout: dict[str, Any]) -> None:
    """No line from the origin to each frame, no legend over a curve."""
    panels = layout["configById"]
    assert panels["3D!scene"]["scene"]["transforms"]["lineWidth"] == 0
    for panel, config in panels.items():
        if panel.startswith("Plot"):
            assert config["legendDisplay"] == "left"


@pytest.mark.parametrize("aspect", [1.2, 1.5, 2.0])
def test_a_room_of_the_usual_size_is_in_sight(
    layout: dict[str, Any], aspect: float
) -> None:
    """With its legend, 0.7 m south of it; aspect is a panel's width over its height."""
    camera = layout["configById"]["3D!scene"]["cameraState"]
    assert (camera["thetaOffset"], camera["perspective"]) == (0, True)
    tilt = math.radians(camera["phi"])  # From straight above, towards the south.
    ahead = np.array([0.0, math.sin(tilt), -math.cos(tilt)])
    up = np.array([0.0, math.cos(tilt), math.sin(tilt)])
    eye = np.array(camera["targetOffset"]) - camera["distance"] * ahead
    half = math.tan(math.radians(0.5 * camera["fovy"]))
    for x, y, z in product((-0.1, 6.1), (-0.7, 6.1), (0.0, 0.2)):
        ray = np.array([x, y, z]) - eye
        assert abs(ray @ up) < half * (ray @ ahead)
        assert abs(ray[0]) < aspect * half * (ray @ ahead)


def test_layouts_are_written_and_never_over_others(tmp_path: Path) -> None:
    paths = write_layouts(tmp_path / "new")
    assert [p.name for p in paths] == [f"beacon-mj.{v}.json" for v in VIEWERS]
    assert write_layouts(tmp_path / "new") == paths
    paths[0].write_text("mine")
    with pytest.raises(LogError, match=r"foxglove.json: expected no file"):
        write_layouts(tmp_path / "new")
    assert paths[0].read_text() == "mine"
    with pytest.raises(LogError, match="cannot write"):
        write_layouts(paths[1])
