"""A family of one's own, with an obstacle of one's own: stools in a larger room.

Usage: python examples/own_family.py
"""

from pathlib import Path

import beacon_mj as bmj
from beacon_mj.mjcf_templates import ROOT

FOLDER = Path("my_templates")
STOOL = """
<mujoco model="stool">
  <compiler angle="radian"/>
  <worldbody>
    <body name="stool" pos="3 3 0.3">
      <freejoint name="stool"/>
      <geom name="seat" type="cylinder" size="0.2 0.02"/>
      <geom name="leg" type="cylinder" size="0.04 0.15" pos="0 0 -0.15"/>
    </body>
  </worldbody>
</mujoco>
"""


def write_family() -> None:
    """Write the obstacle, and a copy of `cluttered` with other numbers."""
    (FOLDER / "obstacles").mkdir(parents=True, exist_ok=True)
    (FOLDER / "obstacles" / "stool.xml").write_text(STOOL)
    text = (ROOT / "families" / "cluttered.xml").read_text()
    edits = {
        '<text name="suite" data="paper-v1"/>': (
            '<numeric name="workspace" data="8 6"/>'
        ),
        '"obstacle_count" data="18 28"': '"obstacle_count" data="10 14"',
        '<include file="../obstacles/sphere.xml"/>': (
            '<include file="obstacles/stool.xml"/>'
        ),
    }
    for old, new in edits.items():
        if old not in text:
            raise SystemExit(f"cluttered.xml: expected {old} but it is not there")
        text = text.replace(old, new)
    (FOLDER / "stools.xml").write_text(text)


if __name__ == "__main__":
    write_family()
    scene = bmj.generate_scene("stools", 0, seed=1000, templates=FOLDER)
    print(f"{len(scene.obstacles)} obstacles, {scene.certificate.margin_m} m of margin")
    results = bmj.evaluate(
        ["dstar-lite"],
        families=["stools"],
        templates=FOLDER,
        scenes_per_family=3,
        seed=1000,
        out="runs/stools",
    )
    print(results.table())
