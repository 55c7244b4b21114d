"""Many open-loop simulations in one call, as far as the project uses them."""

import numpy as np
from mujoco._structs import MjData, MjModel
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

def rollout(
    model: MjModel, data: MjData, initial_state: _Floats, control: _Floats
) -> tuple[_Floats, _Floats]: ...
