"""MuJoCo's functions that the project uses. Arrays called `res` are written to."""

from typing import SupportsIndex

import numpy as np
from mujoco._structs import (
    MjData,
    MjModel,
    MjvCamera,
    MjvGeom,
    MjvOption,
    MjvPerturb,
    MjvScene,
)
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

def mj_camlight(m: MjModel, d: MjData) -> None: ...
def mj_contactForce(
    m: MjModel, d: MjData, id: SupportsIndex, result: _Floats
) -> None: ...
def mj_energyPos(m: MjModel, d: MjData) -> None: ...
def mj_energyVel(m: MjModel, d: MjData) -> None: ...
def mj_forward(m: MjModel, d: MjData) -> None: ...
def mj_geomDistance(
    m: MjModel,
    d: MjData,
    geom1: SupportsIndex,
    geom2: SupportsIndex,
    distmax: float,
    fromto: _Floats | None,
) -> float: ...
def mj_getState(m: MjModel, d: MjData, state: _Floats, sig: SupportsIndex) -> None: ...
def mj_kinematics(m: MjModel, d: MjData) -> None: ...
def mj_mulJacTVec(m: MjModel, d: MjData, res: _Floats, vec: _Floats) -> None: ...
def mj_multiRay(
    m: MjModel,
    d: MjData,
    pnt: _Floats,
    vec: _Floats,
    geomgroup: NDArray[np.uint8] | None,
    flg_static: int,
    bodyexclude: SupportsIndex,
    geomid: NDArray[np.int32],
    dist: _Floats,
    normal: _Floats | None,
    nray: SupportsIndex,
    cutoff: float,
) -> None: ...
def mj_resetData(m: MjModel, d: MjData) -> None: ...
def mj_copyData(dest: MjData, m: MjModel, src: MjData) -> None: ...
def mj_stateSize(m: MjModel, sig: SupportsIndex) -> int: ...
def mj_step(m: MjModel, d: MjData, nstep: SupportsIndex = 1) -> None: ...
def mju_quat2Mat(res: _Floats, quat: _Floats) -> None: ...
def mju_rotVecQuat(res: _Floats, vec: _Floats, quat: _Floats) -> None: ...
def mjv_connector(
    geom: MjvGeom, type: SupportsIndex, width: float, from_: _Floats, to: _Floats
) -> None: ...
def mjv_initGeom(
    geom: MjvGeom,
    type: SupportsIndex,
    size: _Floats,
    pos: _Floats,
    mat: _Floats,
    rgba: NDArray[np.float32],
) -> None: ...
def mjv_updateScene(
    m: MjModel,
    d: MjData,
    opt: MjvOption,
    pert: MjvPerturb | None,
    cam: MjvCamera,
    catmask: SupportsIndex,
    scn: MjvScene,
) -> None: ...
