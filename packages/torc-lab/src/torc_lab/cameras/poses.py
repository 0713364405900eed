"""Read a real camera's pose: from the workspace, from the user, or estimated from the support in the picture.

A finished calibration of easy_handeye (ROS 1, .yaml) or easy_handeye2 (ROS 2, .calib) contains it too. Its transform is
the pose of `tracking_base_frame` in `robot_base_frame` (eye on base), or in `robot_effector_frame` (eye in hand).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from torc import InputError, Observation
from torc.geometry.transforms import Pose
from torc.io.reading import read_plain_text
from torc.io.strict_yaml import parse_plain_yaml
from torc.perception.stereo import SgbmDepth
from torc.pipeline.frames.level import level_pose
from torc.pipeline.frames.plausibility import check_pose
from torc.pipeline.frames.values import parse_pose
from torc.workspace.description import Workspace

WORKSPACE, LEVEL = "workspace", "level"
ON_HAND = "T_tool0_camera"
"""Key of the pose in the calibration of a camera on the hand."""
_MAX_BYTES = 2_000_000
_HOW = (
    "Give --camera.pose level (estimated from the support in each picture), workspace (the camera's pose in the "
    "workspace file), 16 numbers (T_world_camera, row by row, commas between them), or a YAML or JSON file with "
    "T_world_camera (4x4), or position and wxyz; or a calibration file of easy_handeye."
)


def read_pose(given: str | Sequence[float], workspace: Workspace) -> Pose | None:
    """Return T_world_camera (OpenCV axes) for a setting; None if it must be estimated from each picture.

    Raises InputError if the setting is not a valid pose, or its file cannot be read or contains no pose.
    """
    if given == LEVEL:
        return None
    if given == WORKSPACE:
        return workspace.camera.T_world_camera
    try:
        texts = re.split(r"[\s,]+", given.strip("[]() \n")) if isinstance(given, str) else given
        numbers = [float(v) for v in texts]
    except ValueError:
        return _pose_of_file(Path(str(given)))
    if len(numbers) != 16:
        raise InputError(f"The camera's pose has {len(numbers)} numbers, not 16. {_HOW}")
    return checked_pose("The setting camera.pose", numbers, _HOW)


def placed(observation: Observation, pose: Pose | None) -> Observation:
    """Return the observation with this pose; without one, estimate it from the support in the picture.

    An estimated pose has a world frame of its own. If the picture has no depth, its stereo pair provides the depth for
    the estimate. Raises InputError if no support is seen.
    """
    if pose is not None:
        return replace(observation, T_world_camera=pose, pose_estimated=False)
    seen = observation
    if observation.pair is not None and not observation.depth_m.any():
        seen = SgbmDepth().measure(observation)
    return replace(observation, T_world_camera=level_pose(seen), pose_estimated=True)


def read_mapping(path: Path, what: str, how: str) -> dict[Any, Any]:
    """Return the mapping in a YAML or JSON file. `what` and `how` are for error messages. Raises InputError."""
    return parse_plain_yaml(read_plain_text(path, _MAX_BYTES, what), str(path), what, _MAX_BYTES, how)


def checked_pose(where: str, given: Any, how: str) -> Pose:
    """Return a pose given as for `parse_pose`, or as a ROS transform. Raises InputError, beginning with `where`."""
    try:
        is_ros = isinstance(given, Mapping) and "position" not in given
        pose = parse_pose(_parts_of_ros(given) if is_ros else given)
    except (ValueError, TypeError) as error:
        raise InputError(f"{where}: {error}. {how}") from None
    check_pose(where, pose)
    return pose


def _parts_of_ros(content: Mapping[Any, Any]) -> dict[str, Any]:
    """Return position and quaternion, given as x..qw on one level or as translation and rotation. Raises ValueError."""
    nested = content.get("transformation", content.get("transform", content))
    try:
        turn = nested["rotation"] if "rotation" in nested else {a: nested[f"q{a}"] for a in "xyzw"}
        shift = nested.get("translation", nested)
        return {"position": [shift[a] for a in "xyz"], "xyzw": [turn[a] for a in "xyzw"]}
    except (AttributeError, KeyError, TypeError):
        raise ValueError(
            "need position (3) and wxyz (4), or x, y, z, qx, qy, qz, qw, or a translation and a rotation"
        ) from None


def _pose_of_file(path: Path) -> Pose:
    if path.suffix not in (".yaml", ".yml", ".json", ".calib"):
        raise InputError(f"'{path}' says nothing about where the camera is. {_HOW}")
    data = read_mapping(path, "camera pose", _HOW)
    if ON_HAND in data and "T_world_camera" not in data:
        raise InputError(
            f"{path} holds {ON_HAND}, the pose of a camera on the hand in the flange's frame. It moves with the arm, "
            "so that it is not a pose in the world: camera.pose needs a fixed camera. Calibrate one with "
            "`torc lab calibrate --mount fixed`, or use --camera.pose level."
        )
    given = next((data[k] for k in ("T_world_camera", "camera_pose") if k in data), data)
    if any(isinstance(data.get(name), dict) for name in ("transformation", "transform")):
        _check_frames(path, data)
    elif given is data and "position" not in data:  # nor would anybody know in which frame it is
        raise InputError(f"{path} holds no camera pose. {_HOW}")
    return checked_pose(str(path), given, _HOW)


def _check_frames(path: Path, content: Mapping[Any, Any]) -> None:
    """Raise InputError if the transform of an easy_handeye calibration is not the camera's pose in the world."""
    about = content.get("parameters")
    about = about if isinstance(about, dict) else content
    kind = about.get("calibration_type", about.get("eye_on_hand"))
    tracking, base = (str(about.get(f"{name}_base_frame", "")) for name in ("tracking", "robot"))
    if kind in ("eye_on_base", False) and "optical" in tracking and base.strip("/") == "world":
        return
    raise InputError(
        f"{path}: camera.pose needs a camera that is fixed, not on the hand (eye_on_hand: false, or calibration_type: "
        "eye_on_base), its optical frame (z forward, x right, y down) as tracking_base_frame, and the workspace's "
        f"world frame as robot_base_frame. The file says {kind}, tracking_base_frame '{tracking}' and robot_base_frame "
        f"'{base}'. If that is the world frame by another name (`torc lab check` prints where the base stands), write "
        "robot_base_frame: world in the file; else calibrate again, or use --camera.pose level."
    )
