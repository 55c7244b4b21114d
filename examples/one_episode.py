"""Run one episode, log it, and draw what happened.

Usage: python examples/one_episode.py
"""

from pathlib import Path

import beacon_mj as bmj
from beacon_mj.recording import Recorder

if __name__ == "__main__":
    scene = bmj.generate_scene("collision-required", index=0, seed=0)
    name, Beacon = bmj.load_planner("beacon")
    log = Recorder(Path("episode.mcap"))
    trace = bmj.run_episode(scene, Beacon(), name, listeners=[log])
    row = bmj.measure(trace)
    print(f"{trace.outcome} after {row.steps} steps and {row.path_length_m:.2f} m")
    for step in trace.steps:
        for push in step.outcome.attempts:
            print(f"{push.ended_s:.1f} s: {push.obstacle} {push.evidence}")
    print(bmj.plot_panel(log.path, "episode.svg"))
