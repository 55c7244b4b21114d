"""The part of MuJoCo's Python bindings that the project uses, typed by hand.

MuJoCo 3.17 ships no types. `tests/test_stubs.py` holds these against the installed
package; a name that is missing here is added when mypy asks for it.
"""

from mujoco._callbacks import set_mju_user_warning as set_mju_user_warning
from mujoco._enums import mjtCamera as mjtCamera
from mujoco._enums import mjtCatBit as mjtCatBit
from mujoco._enums import mjtCone as mjtCone
from mujoco._enums import mjtDisableBit as mjtDisableBit
from mujoco._enums import mjtEnableBit as mjtEnableBit
from mujoco._enums import mjtFontScale as mjtFontScale
from mujoco._enums import mjtFramebuffer as mjtFramebuffer
from mujoco._enums import mjtGeom as mjtGeom
from mujoco._enums import mjtIntegrator as mjtIntegrator
from mujoco._enums import mjtJacobian as mjtJacobian
from mujoco._enums import mjtJoint as mjtJoint
from mujoco._enums import mjtObj as mjtObj
from mujoco._enums import mjtRndFlag as mjtRndFlag
from mujoco._enums import mjtState as mjtState
from mujoco._enums import mjtWarning as mjtWarning
from mujoco._functions import mj_camlight as mj_camlight
from mujoco._functions import mj_contactForce as mj_contactForce
from mujoco._functions import mj_copyData as mj_copyData
from mujoco._functions import mj_energyPos as mj_energyPos
from mujoco._functions import mj_energyVel as mj_energyVel
from mujoco._functions import mj_forward as mj_forward
from mujoco._functions import mj_geomDistance as mj_geomDistance
from mujoco._functions import mj_getState as mj_getState
from mujoco._functions import mj_kinematics as mj_kinematics
from mujoco._functions import mj_mulJacTVec as mj_mulJacTVec
from mujoco._functions import mj_multiRay as mj_multiRay
from mujoco._functions import mj_resetData as mj_resetData
from mujoco._functions import mj_stateSize as mj_stateSize
from mujoco._functions import mj_step as mj_step
from mujoco._functions import mju_quat2Mat as mju_quat2Mat
from mujoco._functions import mju_rotVecQuat as mju_rotVecQuat
from mujoco._functions import mjv_connector as mjv_connector
from mujoco._functions import mjv_initGeom as mjv_initGeom
from mujoco._functions import mjv_updateScene as mjv_updateScene
from mujoco._render import MjrContext as MjrContext
from mujoco._render import mjr_readPixels as mjr_readPixels
from mujoco._render import mjr_render as mjr_render
from mujoco._render import mjr_setBuffer as mjr_setBuffer
from mujoco._specs import MjDoubleVec as MjDoubleVec
from mujoco._specs import MjsBody as MjsBody
from mujoco._specs import MjsDefault as MjsDefault
from mujoco._specs import MjsGeom as MjsGeom
from mujoco._specs import MjsJoint as MjsJoint
from mujoco._specs import MjsMesh as MjsMesh
from mujoco._specs import MjsNumeric as MjsNumeric
from mujoco._specs import MjSpec as MjSpec
from mujoco._specs import MjsText as MjsText
from mujoco._structs import MjContact as MjContact
from mujoco._structs import MjData as MjData
from mujoco._structs import MjModel as MjModel
from mujoco._structs import MjOption as MjOption
from mujoco._structs import MjrRect as MjrRect
from mujoco._structs import MjvCamera as MjvCamera
from mujoco._structs import MjvGeom as MjvGeom
from mujoco._structs import MjVisual as MjVisual
from mujoco._structs import MjvOption as MjvOption
from mujoco._structs import MjvPerturb as MjvPerturb
from mujoco._structs import MjvScene as MjvScene

__version__: str
mjNGROUP: int
