"""MuJoCo's off-screen drawing."""

from typing import SupportsIndex

import numpy as np
from mujoco._structs import MjModel, MjrRect, MjvScene
from numpy.typing import NDArray

class MjrContext:
    def __init__(self, model: MjModel, fontscale: SupportsIndex, /) -> None: ...
    def free(self) -> None: ...

def mjr_readPixels(
    rgb: NDArray[np.uint8] | None,
    depth: NDArray[np.float32] | None,
    viewport: MjrRect,
    con: MjrContext,
) -> None: ...
def mjr_render(viewport: MjrRect, scn: MjvScene, con: MjrContext) -> None: ...
def mjr_setBuffer(framebuffer: SupportsIndex, con: MjrContext) -> None: ...
