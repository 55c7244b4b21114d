"""Models that can be edited before they are compiled: what reading templates needs."""

from collections.abc import Iterator, Mapping

import numpy as np
from mujoco._enums import mjtGeom, mjtJoint
from mujoco._structs import MjModel
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Singles = NDArray[np.float32]

class MjDoubleVec:
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> float: ...
    def __iter__(self) -> Iterator[float]: ...

class MjsNumeric:
    name: str
    data: MjDoubleVec
    size: int

class MjsText:
    name: str
    data: str

class MjsMesh:
    name: str
    file: str
    scale: _Floats

class MjsGeom:
    name: str
    type: mjtGeom
    meshname: str
    size: _Floats
    pos: _Floats
    quat: _Floats
    fromto: _Floats
    friction: _Floats
    rgba: _Singles

class MjsJoint:
    name: str
    type: mjtJoint

class MjsDefault:
    name: str
    geom: MjsGeom

class MjsBody:
    name: str
    pos: _Floats
    quat: _Floats
    geoms: list[MjsGeom]
    joints: list[MjsJoint]
    bodies: list[MjsBody]

class MjSpec:
    @staticmethod
    def from_file(
        filename: str,
        include: Mapping[str, bytes] | None = None,
        assets: dict[str, bytes] | None = None,
    ) -> MjSpec: ...
    @staticmethod
    def from_string(
        xml: str,
        include: Mapping[str, bytes] | None = None,
        assets: dict[str, bytes] | None = None,
    ) -> MjSpec: ...

    modelname: str
    meshdir: str
    assets: dict[str, bytes]
    worldbody: MjsBody
    default: MjsDefault
    bodies: list[MjsBody]
    geoms: list[MjsGeom]
    joints: list[MjsJoint]
    meshes: list[MjsMesh]
    numerics: list[MjsNumeric]
    texts: list[MjsText]
    def find_default(self, name: str, /) -> MjsDefault | None: ...
    def compile(self) -> MjModel: ...
    def to_xml(self) -> str: ...
