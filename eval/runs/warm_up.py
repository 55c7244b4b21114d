"""Compiling the inner loops before anything is timed.

The machine code is cached on disk, so this takes about a second but for the first time
on a machine, when it takes half a minute. Without it that half minute would fall on
somebody's first decision, which has a time limit.
"""

import functools

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.planners.registry import load_planner
from beacon_mj.scene_gen.generate import generate_scene

#: Planners that between them use every kernel, and how far each is run [steps].
_TOURS = (("beacon", 400), ("beacon-voi", 400), ("dstar-lite", 150), ("bug1", 120))
_SEED = 999_999  #: Of scenes that are in no suite.
_PATIENCE_S = 3600.0


@functools.cache
def compile_kernels() -> None:
    """Run through every compiled kernel, once a process."""
    scene = generate_scene("collision-required", 0, seed=_SEED)
    for name, steps in _TOURS:
        protocol = Protocol(max_steps=steps, decision_limit_s=_PATIENCE_S)
        run_episode(scene, load_planner(name)[1](), name, protocol)
