"""What imperfect sensing costs planners: one condition after the other, one table.

Usage: python examples/cost_of_sensing.py [SCENES_PER_FAMILY [PLANNER...]]
"""

import sys

import beacon_mj as bmj

#: The preset `realistic` part by part, and whole; then nothing but lidar and touch.
CONDITIONS = {
    "perfect": "",
    "occlusion": "protocol.occlusion=true",
    "missed": "protocol.missed_detection=0.05",
    "places": "protocol.pose_noise_m=0.01",
    "own place": "protocol.robot_pose_noise_m=0.02",
    "realistic": "realistic",
    "lidar only": "protocol.obstacles=none protocol.lidar_beams=360",
}


def evaluate(condition: str, planners: list[str], scenes: int) -> bmj.Results:
    """Run the planners under one condition."""
    text = CONDITIONS[condition]
    preset = text == "realistic"
    return bmj.evaluate(
        planners,
        scenes_per_family=scenes,
        protocol=text if preset else None,
        settings=[] if preset else text.split(),
        out=f"runs/sensing/{condition.replace(' ', '-')}",
        log="none",
        report=False,
        resume=True,
    )


def line(planner: str, condition: str, overall: dict) -> str:
    """Return a row of the table: rates in percent and steps, with 95 % intervals."""
    cells = [planner, condition, str(overall["n"])]
    for name in ("success", "clean_success"):
        rate, low, high = (100.0 * overall[name][k] for k in ("rate", "low", "high"))
        cells.append(f"{rate:.0f} [{low:.0f}, {high:.0f}]")
    steps = overall["mean"]["steps"]
    cells.append(f"{steps['mean']:.0f} [{steps['low']:.0f}, {steps['high']:.0f}]")
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    scenes = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    planners = sys.argv[2:] or ["beacon"]
    found = {name: evaluate(name, planners, scenes) for name in CONDITIONS}
    tables = {name: results.summary()["tables"] for name, results in found.items()}
    print("| planner | sensing | n | success % | clean % | steps |")
    print("|---|---|---:|---:|---:|---:|")
    for planner in tables["perfect"]:
        for name, table in tables.items():
            print(line(planner, name, table[planner]["overall"]))
