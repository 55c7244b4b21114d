"""A planner in a program of its own, without any package: lines of JSON in and out.

It drives at the goal and slides along what is in the way. docs/exec.md has the
protocol.

Usage: beacon-mj eval --planner "exec:python3 examples/exec_python.py" --family sparse
"""

import json
import math
import sys

CONFIG = {"clearance_m": 0.05}  # What --set exec_python.clearance_m=0.1 changes.


def nearest(footprint, x, y):
    """Return the nearest point of an outline's core, and whether (x, y) is within."""
    core, best, inside = footprint["vertices"], None, len(footprint["vertices"]) > 2
    for (ax, ay), (bx, by) in zip(core, core[1:] + core[:1], strict=True):
        ex, ey = bx - ax, by - ay
        square = ex * ex + ey * ey
        t = ((x - ax) * ex + (y - ay) * ey) / square if square else 0.0
        t = min(1.0, max(0.0, t))
        px, py = ax + t * ex, ay + t * ey
        inside = inside and ex * (y - ay) - ey * (x - ax) > 0
        if best is None or math.dist((px, py), (x, y)) < math.dist(best, (x, y)):
            best = px, py
    return best, inside


def decide(task, config, seen):
    """Return a velocity: towards the goal, less what leads into an obstacle."""
    x, y = seen["position_m"]
    gx, gy = task["goal_m"]
    away = max(math.dist((gx, gy), (x, y)), 1e-9)
    vx, vy = (gx - x) / away, (gy - y) / away
    for obstacle in seen["obstacles"]:
        (px, py), inside = nearest(obstacle["footprint"], x, y)
        apart = max(math.dist((px, py), (x, y)), 1e-9)
        gap = apart - obstacle["footprint"]["radius"] - task["radius_m"]
        if inside or gap < config["clearance_m"]:
            nx, ny = (px - x) / apart, (py - y) / apart
            into = max(vx * nx + vy * ny, 0.0)
            # Along the edge, always on the same side: enough for one obstacle.
            vx, vy = vx - into * (nx - 0.5 * ny), vy - into * (ny + 0.5 * nx)
    pace = min(task["speed_mps"], away / task["control_period_s"])
    return [pace * vx, pace * vy]


def answer(message, memory):
    """Return the answer to a message; `memory` holds the task of the episode."""
    kind = message["type"]
    if kind == "hello":
        return {"type": "hello", "protocol": 1, "config": CONFIG}
    if kind in ("reset", "next_day"):
        memory.update(message)
        return {"type": "ready"}
    velocity = decide(memory["task"], memory["config"], message["observation"])
    return {
        "type": "command",
        "velocity_mps": velocity,
        "info": {"reason": "Straight on, or along an edge."},
    }


if __name__ == "__main__":
    memory = {}
    for line in sys.stdin:
        message = json.loads(line)
        reply = {"id": message["id"]} | answer(message, memory)
        print(json.dumps(reply), flush=True)
