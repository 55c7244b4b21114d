"""The messages of a log: Foxglove's, and our own.

Each message is written as `name:type` per field, numbered from one in order. A star
marks a repeated field, a question mark one whose absence means something. Field names
of our own messages carry the unit; vectors are in the arena frame.
"""

from typing import Final

#: Foxglove's message definitions, field for field those of foxglove-sdk 0.30.
FOXGLOVE: Final[dict[str, str]] = {
    "Vector2": "x:double y:double",
    "Vector3": "x:double y:double z:double",
    "Point3": "x:double y:double z:double",
    "Quaternion": "x:double y:double z:double w:double",
    "Color": "r:double g:double b:double a:double",
    "KeyValuePair": "key:string value:string",
    "Pose": "position:Vector3 orientation:Quaternion",
    "PoseInFrame": "timestamp:Timestamp frame_id:string pose:Pose",
    "PosesInFrame": "timestamp:Timestamp frame_id:string poses:*Pose",
    "FrameTransform": "timestamp:Timestamp parent_frame_id:string "
    "child_frame_id:string translation:Vector3 rotation:Quaternion",
    "FrameTransforms": "transforms:*FrameTransform",
    "Log": "timestamp:Timestamp level:Level message:string name:string file:string "
    "line:fixed32",
    "ArrowPrimitive": "pose:Pose shaft_length:double shaft_diameter:double "
    "head_length:double head_diameter:double color:Color",
    "CubePrimitive": "pose:Pose size:Vector3 color:Color",
    "SpherePrimitive": "pose:Pose size:Vector3 color:Color",
    "CylinderPrimitive": "pose:Pose size:Vector3 bottom_scale:double top_scale:double "
    "color:Color",
    "LinePrimitive": "type:Type pose:Pose thickness:double scale_invariant:bool "
    "points:*Point3 color:Color colors:*Color indices:*fixed32",
    "TriangleListPrimitive": "pose:Pose points:*Point3 color:Color colors:*Color "
    "indices:*fixed32",
    "TextPrimitive": "pose:Pose billboard:bool font_size:double scale_invariant:bool "
    "color:Color text:string",
    "ModelPrimitive": "pose:Pose scale:Vector3 color:Color override_color:bool "
    "url:string media_type:string data:bytes",
    "SceneEntity": "timestamp:Timestamp frame_id:string id:string lifetime:Duration "
    "frame_locked:bool metadata:*KeyValuePair arrows:*ArrowPrimitive "
    "cubes:*CubePrimitive spheres:*SpherePrimitive cylinders:*CylinderPrimitive "
    "lines:*LinePrimitive triangles:*TriangleListPrimitive texts:*TextPrimitive "
    "models:*ModelPrimitive",
    "SceneEntityDeletion": "timestamp:Timestamp type:Type id:string",
    "SceneUpdate": "deletions:*SceneEntityDeletion entities:*SceneEntity",
    "LaserScan": "timestamp:Timestamp frame_id:string pose:Pose start_angle:double "
    "end_angle:double ranges:*double intensities:*double",
}

#: Enumerations nested in Foxglove's messages.
ENUMS: Final[dict[str, tuple[str, ...]]] = {
    "Log.Level": ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"),
    "LinePrimitive.Type": ("LINE_STRIP", "LINE_LOOP", "LINE_LIST"),
    "SceneEntityDeletion.Type": ("MATCHING_ID", "ALL"),
}

#: Our own messages.
BEACON: Final[dict[str, str]] = {
    "Displacement": "obstacle:string distance_m:double chain:*string",
    "Step": "step:uint32 time_s:double position_m:foxglove.Vector2 "
    "velocity_mps:foxglove.Vector2 bumper_force_n:foxglove.Vector2 "
    "drive_effort:double actuator_work_j:double battery:double "
    "newly_sensed:*string displacements:*Displacement toppled:*string",
    "State": "step:uint32 full:bool qpos_index:*uint32 qpos:*double "
    "qvel_index:*uint32 qvel:*double",
    "Command": "velocity_mps:foxglove.Vector2 has_path:bool "
    "path_head:*foxglove.Vector2 path_tail:uint32",
    "Turn": "turn_rate_radps:double",
    "Term": "name:string value:double",
    "Decision": "action:string reason:string target:?string cost_push:?double "
    "cost_detour:?double terms:*Term replanned:bool expansions:uint64",
    "Timeline": "action:string target:string push:string",
    "ClassBelief": "obstacle:string safe:double movable:double fragile:double",
    "Belief": "obstacles:*ClassBelief",
    "ContactForce": "obstacle:string counterpart:string force_n:foxglove.Vector3 "
    "point_m:foxglove.Vector3 filtered_n:double peak_n:double "
    "filtered_peak_n:double impulse_ns:double",
    "Contacts": "contacts:*ContactForce",
    "Push": "obstacle:string evidence:string force_n:double began_s:double "
    "ended_s:double",
    "Damage": "obstacle:string counterpart:string force_n:double time_s:double",
    "SensedObstacle": "obstacle:string centroid_m:foxglove.Vector2 "
    "density_kgm3:double friction:double scores:ClassBelief broken:bool "
    "kind:?string",
    "FeltForce": "obstacle:string force_n:double",
    "Told": "position_m:foxglove.Vector2 bumper_force_n:foxglove.Vector2 "
    "contacts:*FeltForce evidence:*FeltForce",
    "Sensed": "visible:*string updated:*SensedObstacle",
}

#: Which message each topic carries. Only logs of robots with a lidar have `/scan`.
TOPICS: Final[dict[str, str]] = {
    "/tf": "foxglove.FrameTransforms",
    "/tf/start": "foxglove.FrameTransforms",
    "/tf/moved": "foxglove.FrameTransforms",
    "/scene": "foxglove.SceneUpdate",
    "/labels": "foxglove.SceneUpdate",
    "/robot": "foxglove.PoseInFrame",
    "/plan": "foxglove.PosesInFrame",
    "/log": "foxglove.Log",
    "/contacts/arrows": "foxglove.SceneUpdate",
    "/contacts": "beacon_mj.Contacts",
    "/command": "beacon_mj.Command",
    "/decision": "beacon_mj.Decision",
    "/timeline": "beacon_mj.Timeline",
    "/belief": "beacon_mj.Belief",
    "/belief/rounded": "beacon_mj.Belief",
    "/belief/picture": "foxglove.SceneUpdate",
    "/sensed": "beacon_mj.Sensed",
    "/told": "beacon_mj.Told",
    "/push": "beacon_mj.Push",
    "/damage": "beacon_mj.Damage",
    "/state": "beacon_mj.State",
    "/step": "beacon_mj.Step",
    "/turn": "beacon_mj.Turn",
    "/scan": "foxglove.LaserScan",
}
#: Those of robots that turn, or have a lidar; other logs have no such channels.
OPTIONAL_TOPICS: Final = frozenset({"/scan", "/turn"})

SCENE_NAME: Final = "scene.json"  #: Name of the attached scene.
WORLD_NAME: Final = "world.xml"  #: Name of the attached MJCF world.
