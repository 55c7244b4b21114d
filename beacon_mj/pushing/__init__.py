"""What a push sets in motion: the models that planners and the planar world share."""

from typing import Literal

#: How the planar world pushes; see `beacon_mj.world.planar`.
PushModel = Literal["paper", "limit-surface"]
