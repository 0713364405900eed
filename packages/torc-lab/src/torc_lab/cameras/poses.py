"""Where a real camera is: from the workspace, as the user says, or estimated from the support in the picture."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from torc import InputError, Observation
from torc.geometry.transforms import Pose
from torc.io.reading import read_plain_text
from torc.io.strict_yaml import parse_plain_yaml
from torc.perception.stereo import SgbmDepth
from torc.pipeline.frames.level import level_pose
from torc.pipeline.frames.plausibility import check_pose
from torc.pipeline.frames.values import parse_pose
from torc.workspace.description import Workspace
from torc_lab.cameras.easy_handeye import is_easy_handeye, pose_of_easy_handeye

WORKSPACE, LEVEL = "workspace", "level"
ON_HAND = "T_tool0_camera"
"""What a calibration of a camera on the hand holds."""
_MAX_BYTES = 100_000
_HOW = (
    "Give --camera.pose level (estimated from the support in each picture), workspace (the camera's pose in the "
    "workspace file), 16 numbers (T_world_camera, row by row, commas between them), or a YAML or JSON file with "
    "T_world_camera (4x4), or position and wxyz; or a calibration file of easy_handeye."
)


def read_pose(given: str | Sequence[float], workspace: Workspace) -> Pose | None:
    """T_world_camera (OpenCV axes) by a setting; None where it is to be estimated from each picture.

    Raises InputError for a setting that is no pose, and for a file that cannot be read or holds none.
    """
    if given == LEVEL:
        return None
    if given == WORKSPACE:
        return workspace.camera.T_world_camera
    numbers = _numbers(given)
    if numbers is None:
        return _pose_of_file(Path(str(given)))
    if len(numbers) != 16:
        raise InputError(f"The camera's pose has {len(numbers)} numbers, not 16. {_HOW}")
    return _checked("The setting camera.pose", np.reshape(numbers, (4, 4)).tolist())


def placed(observation: Observation, pose: Pose | None) -> Observation:
    """The observation with that pose, or else with the one that the support in it gives, in a world of its own.

    A picture without depth of its own gets some from its stereo pair for that. Raises InputError if no support is seen.
    """
    if pose is not None:
        return replace(observation, T_world_camera=pose, pose_estimated=False)
    seen = observation
    if observation.pair is not None and not observation.depth_m.any():
        seen = SgbmDepth().measure(observation)
    return replace(observation, T_world_camera=level_pose(seen), pose_estimated=True)


def _numbers(given: str | Sequence[float]) -> list[float] | None:
    """The numbers of a list, or of a text of numbers; None for other text."""
    if not isinstance(given, str):
        return [float(v) for v in given]
    try:
        return [float(v) for v in re.split(r"[\s,]+", given.strip("[]() \n"))]
    except ValueError:
        return None


def _pose_of_file(path: Path) -> Pose:
    if path.suffix not in (".yaml", ".yml", ".json", ".calib"):
        raise InputError(f"'{path}' says nothing about where the camera is. {_HOW}")
    text = read_plain_text(path, _MAX_BYTES, "the camera's pose")
    if path.suffix == ".json":
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path} is not readable JSON: {error}. {_HOW}") from error
    else:
        data = parse_plain_yaml(text, str(path), "camera pose", _MAX_BYTES, _HOW)
    if not isinstance(data, dict):
        raise InputError(f"{path} holds no camera pose. {_HOW}")
    if is_easy_handeye(data):
        pose = pose_of_easy_handeye(str(path), data)
        check_pose(str(path), pose)
        return pose
    if ON_HAND in data and "T_world_camera" not in data:
        raise InputError(
            f"{path} holds {ON_HAND}, the pose of a camera on the hand in the flange's frame. It moves with the arm, "
            "so that it is not a pose in the world: camera.pose needs a fixed camera. Calibrate one with "
            "`torc lab calibrate --mount fixed`, or use --camera.pose level."
        )
    given = next((data[k] for k in ("T_world_camera", "camera_pose") if k in data), data)
    return _checked(str(path), given)


def _checked(where: str, given: Any) -> Pose:
    try:
        pose = parse_pose(given)
    except ValueError as error:
        raise InputError(f"{where}: {error}. {_HOW}") from error
    check_pose(where, pose)
    return pose
