"""Evaluate two planners on the same scenes, and compare them scene by scene.

Usage: python examples/compare_planners.py
"""

import beacon_mj as bmj

if __name__ == "__main__":
    results = bmj.evaluate(
        ["dstar-lite", "beacon"],
        families=["collision-shortcut"],
        scenes_per_family=4,
        seed=1000,
        out="runs/compared",
    )
    print(results.table())
    print(bmj.compare(results, baseline="dstar-lite"))
    costs = results.rows.select("planner", "steps", "energy_j")
    print(costs.group_by("planner").mean().sort("planner"))
