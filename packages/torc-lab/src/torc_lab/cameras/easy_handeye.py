"""A finished calibration of easy_handeye (ROS 1, .yaml) or easy_handeye2 (ROS 2, .calib) as a camera's pose.

Its transform is the pose of `tracking_base_frame` in `robot_base_frame` (eye on base), or in `robot_effector_frame`
(eye in hand), with quaternions x, y, z, w.
"""

from collections.abc import Mapping
from typing import Any

from torc import InputError
from torc.geometry.transforms import Pose
from torc.pipeline.frames.values import parse_pose

_WORLD = "world"
_OPTICAL = "optical"


def is_easy_handeye(content: Mapping[Any, Any]) -> bool:
    """Whether a file's content has the form of a finished calibration of either version."""
    return any(isinstance(content.get(name), dict) for name in ("transformation", "transform"))


def pose_of_easy_handeye(where: str, content: Mapping[Any, Any]) -> Pose:
    """T_world_camera. Raises InputError for a camera on the hand, and for frames that are not torc's."""
    about = content.get("parameters", content)
    about = about if isinstance(about, dict) else {}
    if _on_hand(where, about):
        raise InputError(
            f"{where}: this camera is on the hand: the file has its pose in {about.get('robot_effector_frame')}, not "
            "in the world. camera.pose needs a fixed camera. Calibrate a fixed one, or use --camera.pose level."
        )
    tracking, base = (str(about.get(f"{name}_base_frame", "")) for name in ("tracking", "robot"))
    if _OPTICAL not in tracking:
        raise InputError(
            f"{where}: tracking_base_frame is '{tracking}'. It must be the camera's optical frame (z forward, x right, "
            "y down), e.g. camera_color_optical_frame. Calibrate again with that frame."
        )
    if base.strip("/") != _WORLD:
        raise InputError(
            f"{where}: the pose is relative to robot_base_frame '{base}', and camera.pose is relative to the "
            f"workspace's world frame. If both are the same frame (`torc lab check` prints where the base stands), "
            f"write robot_base_frame: {_WORLD} in the file; else calibrate again with the world frame, or give "
            "T_world_camera."
        )
    try:
        return parse_pose(transform(content))
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None


def transform(content: Mapping[Any, Any]) -> dict[str, Any]:
    """Position and wxyz of x..qw on one level, or of a translation and a rotation of ROS. Raises ValueError."""
    nested = content.get("transformation", content.get("transform", content))
    if not isinstance(nested, dict):
        raise ValueError("need a transformation with x, y, z, qx, qy, qz, qw")
    shift, turn = nested.get("translation", nested), nested.get("rotation", nested)
    if not isinstance(shift, dict) or not isinstance(turn, dict):
        raise ValueError("need a translation with x, y, z and a rotation with x, y, z, w")
    prefix = "" if "rotation" in nested else "q"
    wxyz = [turn.get(prefix + axis) for axis in "wxyz"]
    return {"position": [shift.get(axis) for axis in "xyz"], "wxyz": wxyz}


def _on_hand(where: str, about: Mapping[Any, Any]) -> bool:
    kind, flag = about.get("calibration_type"), about.get("eye_on_hand")
    if kind in ("eye_in_hand", "eye_on_base"):
        return bool(kind == "eye_in_hand")
    if isinstance(flag, bool):
        return flag
    raise InputError(
        f"{where}: it does not say where the camera is. easy_handeye writes eye_on_hand: true or false, easy_handeye2 "
        "calibration_type: eye_in_hand or eye_on_base."
    )
