"""MuJoCo's structures: the fields that the project uses.

Arrays are views into MuJoCo's memory: assign to their elements. Shapes are in MuJoCo's
documentation of mjModel, mjData and mjvScene.
"""

from collections.abc import Mapping
from typing import SupportsIndex, overload

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Singles = NDArray[np.float32]
_Integers = NDArray[np.int32]

class _MjModelActuatorViews:
    id: int
    name: str
    forcerange: _Floats

class _MjModelBodyViews:
    id: int
    name: str
    geomadr: _Integers
    geomnum: _Integers
    mass: _Floats
    pos: _Floats

class _MjModelGeomViews:
    id: int
    name: str
    conaffinity: _Integers
    contype: _Integers
    friction: _Floats
    pos: _Floats
    priority: _Integers
    size: _Floats

class _MjModelJointViews:
    id: int
    name: str
    dofadr: _Integers
    qposadr: _Integers
    stiffness: _Floats

class _MjModelSiteViews:
    id: int
    name: str
    pos: _Floats
    rgba: _Singles
    size: _Floats

class _MjDataBodyViews:
    id: int
    name: str
    xpos: _Floats

class MjOption:
    disableflags: int
    enableflags: int
    impratio: float
    timestep: float
    @property
    def cone(self) -> int: ...
    @cone.setter
    def cone(self, value: SupportsIndex) -> None: ...
    @property
    def integrator(self) -> int: ...
    @integrator.setter
    def integrator(self, value: SupportsIndex) -> None: ...
    @property
    def jacobian(self) -> int: ...
    @jacobian.setter
    def jacobian(self, value: SupportsIndex) -> None: ...

class MjVisual:
    class Global:
        offwidth: int
        offheight: int

    class Headlight:
        ambient: _Singles
        diffuse: _Singles

    class Map:
        shadowclip: float
        znear: float

    class Quality:
        shadowsize: int

    global_: Global
    headlight: Headlight
    map: Map
    quality: Quality

class MjModel:
    @staticmethod
    def from_xml_path(
        filename: str, assets: Mapping[str, bytes] | None = None
    ) -> MjModel: ...
    @staticmethod
    def from_xml_string(
        xml: str, assets: Mapping[str, bytes] | None = None
    ) -> MjModel: ...
    def __copy__(self) -> MjModel: ...

    nbody: int
    ngeom: int
    nv: int
    opt: MjOption
    vis: MjVisual
    qpos0: _Floats
    actuator_gainprm: _Floats
    actuator_gear: _Floats
    body_mass: _Floats
    body_parentid: _Integers
    body_pos: _Floats
    body_rootid: _Integers
    dof_damping: _Floats
    geom_bodyid: _Integers
    geom_condim: _Integers
    geom_contype: _Integers
    geom_dataid: _Integers
    geom_group: _Integers
    geom_pos: _Floats
    geom_priority: _Integers
    geom_quat: _Floats
    geom_rgba: _Singles
    geom_size: _Floats
    geom_type: _Integers
    light_diffuse: _Singles
    mesh_face: _Integers
    mesh_faceadr: _Integers
    mesh_facenum: _Integers
    mesh_vert: _Singles
    mesh_vertadr: _Integers
    mesh_vertnum: _Integers
    def actuator(self, name: str | SupportsIndex, /) -> _MjModelActuatorViews: ...
    def body(self, name: str | SupportsIndex, /) -> _MjModelBodyViews: ...
    def geom(self, name: str | SupportsIndex, /) -> _MjModelGeomViews: ...
    def joint(self, name: str | SupportsIndex, /) -> _MjModelJointViews: ...
    def site(self, name: str | SupportsIndex, /) -> _MjModelSiteViews: ...

class MjContact:
    dim: int
    dist: float
    efc_address: int
    friction: _Floats
    geom: _Integers
    frame: _Floats
    pos: _Floats

class _MjContactList:
    """The contacts of one physics step; its arrays stack those of all of them."""

    efc_address: _Integers
    geom: _Integers
    frame: _Floats
    pos: _Floats
    def __len__(self) -> int: ...
    def __getitem__(self, index: SupportsIndex, /) -> MjContact: ...

class _MjWarningStatList:
    number: _Integers

class MjData:
    def __init__(self, model: MjModel, /) -> None: ...

    time: float
    ncon: int
    nefc: int
    ntree_awake: int
    contact: _MjContactList
    warning: _MjWarningStatList
    actuator_force: _Floats
    actuator_velocity: _Floats
    ctrl: _Floats
    efc_force: _Floats
    energy: _Floats
    geom_xmat: _Floats
    geom_xpos: _Floats
    qfrc_constraint: _Floats
    qpos: _Floats
    qvel: _Floats
    xfrc_applied: _Floats
    xpos: _Floats
    xquat: _Floats
    def body(self, name: str | SupportsIndex, /) -> _MjDataBodyViews: ...

class MjrRect:
    def __init__(self, left: int, bottom: int, width: int, height: int) -> None: ...

class MjvCamera:
    azimuth: float
    distance: float
    elevation: float
    lookat: _Floats
    @property
    def type(self) -> int: ...
    @type.setter
    def type(self, value: SupportsIndex) -> None: ...

class MjvGeom:
    label: str
    objid: int
    objtype: int
    pos: _Singles
    rgba: _Singles
    size: _Singles
    @property
    def type(self) -> int: ...
    @property
    def category(self) -> int: ...
    @category.setter
    def category(self, value: SupportsIndex) -> None: ...

class MjvOption: ...
class MjvPerturb: ...

class MjvGLCamera:
    forward: _Singles
    frustum_near: float
    frustum_top: float
    pos: _Singles
    up: _Singles

class MjvScene:
    @overload
    def __init__(self) -> None: ...
    @overload
    def __init__(self, model: MjModel, maxgeom: int) -> None: ...

    camera: tuple[MjvGLCamera, ...]
    flags: NDArray[np.uint8]
    geoms: tuple[MjvGeom, ...]
    maxgeom: int
    ngeom: int
