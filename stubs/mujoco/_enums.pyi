"""MuJoCo's enumerations: the members that the project uses."""

from typing import ClassVar

class _Enum:
    """What MuJoCo's enumerations share: they mix with integers, which then remain."""

    name: str
    value: int
    def __init__(self, value: int) -> None: ...
    def __eq__(self, other: object) -> bool: ...
    def __hash__(self) -> int: ...
    def __int__(self) -> int: ...
    def __index__(self) -> int: ...
    def __or__(self, other: int | _Enum) -> int: ...
    def __ror__(self, other: int) -> int: ...
    def __and__(self, other: int | _Enum) -> int: ...
    def __rand__(self, other: int) -> int: ...

class mjtCamera(_Enum):
    mjCAMERA_FREE: ClassVar[mjtCamera]

class mjtCatBit(_Enum):
    mjCAT_ALL: ClassVar[mjtCatBit]
    mjCAT_DECOR: ClassVar[mjtCatBit]

class mjtCone(_Enum):
    mjCONE_ELLIPTIC: ClassVar[mjtCone]

class mjtDisableBit(_Enum):
    mjDSBL_ACTUATION: ClassVar[mjtDisableBit]
    mjDSBL_AUTORESET: ClassVar[mjtDisableBit]
    mjDSBL_CONTACT: ClassVar[mjtDisableBit]

class mjtEnableBit(_Enum):
    mjENBL_SLEEP: ClassVar[mjtEnableBit]

class mjtFontScale(_Enum):
    mjFONTSCALE_100: ClassVar[mjtFontScale]

class mjtFramebuffer(_Enum):
    mjFB_OFFSCREEN: ClassVar[mjtFramebuffer]

class mjtGeom(_Enum):
    mjGEOM_PLANE: ClassVar[mjtGeom]
    mjGEOM_HFIELD: ClassVar[mjtGeom]
    mjGEOM_SPHERE: ClassVar[mjtGeom]
    mjGEOM_CAPSULE: ClassVar[mjtGeom]
    mjGEOM_ELLIPSOID: ClassVar[mjtGeom]
    mjGEOM_CYLINDER: ClassVar[mjtGeom]
    mjGEOM_BOX: ClassVar[mjtGeom]
    mjGEOM_MESH: ClassVar[mjtGeom]
    mjGEOM_ARROW: ClassVar[mjtGeom]
    mjGEOM_LABEL: ClassVar[mjtGeom]

class mjtIntegrator(_Enum):
    mjINT_IMPLICITFAST: ClassVar[mjtIntegrator]

class mjtJacobian(_Enum):
    mjJAC_DENSE: ClassVar[mjtJacobian]
    mjJAC_SPARSE: ClassVar[mjtJacobian]

class mjtJoint(_Enum):
    mjJNT_FREE: ClassVar[mjtJoint]
    mjJNT_BALL: ClassVar[mjtJoint]
    mjJNT_SLIDE: ClassVar[mjtJoint]
    mjJNT_HINGE: ClassVar[mjtJoint]

class mjtObj(_Enum):
    mjOBJ_GEOM: ClassVar[mjtObj]

class mjtRndFlag(_Enum):
    mjRND_HAZE: ClassVar[mjtRndFlag]

class mjtState(_Enum):
    mjSTATE_FULLPHYSICS: ClassVar[mjtState]

class mjtWarning(_Enum): ...
