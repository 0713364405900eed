"""Calibrations from what others stored: pictures with a list of the flange's poses, and samples of easy_handeye."""

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from torc import InputError
from torc.geometry.transforms import Pose, invert
from torc.io.reading import read_bytes, read_plain_text
from torc.io.strict_yaml import parse_plain_yaml
from torc.pipeline.frames.plausibility import check_pose
from torc.pipeline.frames.values import parse_pose
from torc_lab.calibration.board import Board
from torc_lab.calibration.board_views import BoardView
from torc_lab.calibration.noisy_arm import Mounting, PoseView
from torc_lab.calibration.pose_frames import PoseFrame
from torc_lab.cameras.easy_handeye import transform

_MAX_BYTES, _MAX_PICTURE_BYTES, _MAX_ENTRIES = 2_000_000, 100_000_000, 1000
_SAMPLE_VARIANCE = np.repeat([1e-3**2, 5e-4**2], 3)
"""Of a marker's pose, turn (rad) then shift (m): samples do not say; the arm's noise is estimated beside it."""
_IN_WORLD = "T_world_tool0"
_HOW = (
    "Give a .csv with the columns picture, x, y, z, qx, qy, qz, qw, or a .json or .yaml with a list `poses` of entries "
    "with picture and either position and wxyz, or T_world_tool0 (4x4). Metres; of the flange."
)
_SAMPLES_HOW = "Give the .samples file that easy_handeye2 saves: a list `samples` of robot and tracking."


def views_of_pictures(
    poses: Path, pictures: Path, board: Board, frame: PoseFrame | None
) -> tuple[list[BoardView], tuple[int, int]]:
    """Return the views whose picture shows the board, with the flange's poses in the world; and the pictures' width and
    height. `frame` is that of poses that are not named T_world_tool0; None: such poses are refused. Raises InputError
    and LabError.
    """
    views: list[BoardView] = []
    sizes: set[tuple[int, int]] = set()
    for name, flange in _listed(poses, frame):
        gray = _picture(pictures, name, poses)
        sizes.add((gray.shape[1], gray.shape[0]))
        if len(sizes) > 1:
            raise InputError(
                f"{pictures / name} is of another size than the pictures before it: one camera, one size."
            )
        found = board.find(gray)
        if found is not None:
            views.append(BoardView(flange, found))
    if not sizes:
        raise InputError(f"{poses} lists no picture. {_HOW}")
    return views, sizes.pop()


def samples_of_easy_handeye(path: Path, mounting: Mounting, frame: PoseFrame) -> list[PoseView]:
    """Return the samples, with the flange's poses in the world; the file gives them in `frame`, the robot_base_frame.
    For a fixed camera easy_handeye stores the base's pose in the hand, not the hand's in the base.

    Raises InputError: unreadable, not of that form, or not of the camera's optical frame.
    """
    samples = _content(path, _SAMPLES_HOW).get("samples")
    if not isinstance(samples, list) or not samples or len(samples) > _MAX_ENTRIES:
        raise InputError(f"{path} holds no samples. {_SAMPLES_HOW}")
    views = []
    for k, sample in enumerate(samples):
        where = f"{path}, sample {k + 1}"
        if not isinstance(sample, dict) or not all(
            isinstance(sample.get(n), dict) for n in ("robot", "tracking")
        ):
            raise InputError(f"{where}: robot or tracking is missing. {_SAMPLES_HOW}")
        robot, seen = (_pose(where, transform_of(where, sample[name])) for name in ("robot", "tracking"))
        if seen[2, 3] <= 0:
            raise InputError(
                f"{where}: the marker lies behind the camera (z = {seen[2, 3]:.3f} m). tracking_base_frame must be the "
                "camera's optical frame (z forward, x right, y down)."
            )
        flange = invert(robot) if mounting == "fixed" else robot
        views.append(PoseView(frame.T_world_frame @ flange, seen, np.diag(_SAMPLE_VARIANCE)))
    return views


def transform_of(where: str, entry: Mapping[Any, Any]) -> dict[str, Any]:
    """Position and wxyz of a transform of ROS. Raises InputError."""
    try:
        return transform(entry)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None


def _listed(path: Path, frame: PoseFrame | None) -> list[tuple[str, Pose]]:
    """Pictures' names and the flange's poses in the world."""
    if path.suffix == ".csv":
        text = read_plain_text(path, _MAX_BYTES, "the list of poses")
        entries: Any = list(csv.DictReader(io.StringIO(text), skipinitialspace=True))
    else:
        entries = _content(path, _HOW).get("poses")
    if not isinstance(entries, list) or len(entries) > _MAX_ENTRIES:
        raise InputError(f"{path} holds no list of poses. {_HOW}")
    return [_entry(f"{path}, pose {k + 1}", entry, frame) for k, entry in enumerate(entries)]


def _entry(where: str, entry: Any, frame: PoseFrame | None) -> tuple[str, Pose]:
    if not isinstance(entry, dict) or not isinstance(entry.get("picture"), str):
        raise InputError(f"{where}: no picture is named. {_HOW}")
    if _IN_WORLD in entry:
        return entry["picture"], _pose(where, entry[_IN_WORLD])
    pose = _pose(where, entry if "position" in entry else transform_of(where, entry))
    if frame is None:
        raise InputError(
            f"{where}: in which frame? This robot's base is not the world frame. Add --frame base (what controllers, "
            f"TF and easy_handeye give) or --frame world, or name the poses {_IN_WORLD}."
        )
    return entry["picture"], np.asarray(frame.T_world_frame @ pose)


def _pose(where: str, given: Any) -> Pose:
    try:
        pose = parse_pose(given)
    except (ValueError, TypeError) as error:
        raise InputError(f"{where}: {error}. {_HOW}") from None
    check_pose(where, pose)
    return pose


def _content(path: Path, how: str) -> dict[Any, Any]:
    text = read_plain_text(path, _MAX_BYTES, "a list of poses")
    if path.suffix != ".json":
        return parse_plain_yaml(text, str(path), "list of poses", _MAX_BYTES, how)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not readable JSON: {error}. {how}") from None
    return content if isinstance(content, dict) else {"poses": content}


def _picture(folder: Path, name: str, poses: Path) -> np.ndarray:
    if Path(name).is_absolute() or ".." in Path(name).parts:
        raise InputError(f"{poses}: picture '{name}' is not a name inside {folder}.")
    data = read_bytes(folder / name, _MAX_PICTURE_BYTES, f"a picture that {poses} names")
    gray = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE) if data else None
    if gray is None:
        raise InputError(f"{folder / name} is not a picture: give .png or .jpg files.")
    return np.asarray(gray)
