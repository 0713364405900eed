"""Calibrate from stored data: pictures with a list of the flange's poses, or samples of easy_handeye.

Other programs give poses in the robot's base frame, unless that is the world.
"""

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from torc import InputError
from torc.geometry.transforms import Pose, invert, make_pose
from torc.io.reading import read_plain_text
from torc.robots.description import ArmDescription
from torc_lab.calibration.board import Board, BoardView
from torc_lab.calibration.noisy_arm import Mounting, PoseView
from torc_lab.cameras.poses import checked_pose, read_mapping

_MAX_BYTES, _MAX_ENTRIES = 2_000_000, 1000
_SAMPLE_VARIANCE = np.repeat([1e-3**2, 5e-4**2], 3)
"""Assumed for a marker's pose, turn (rad) then shift (m), as samples lack it; the arm's noise is estimated too."""
_IN_WORLD = "T_world_tool0"
_HOW = (
    "Give a .csv with the columns picture, x, y, z, qx, qy, qz, qw, or a .json or .yaml with a list `poses` of entries "
    "with picture and either these, position and wxyz, or T_world_tool0 (4x4). Metres; of the flange."
)
_SAMPLES_HOW = (
    "Give the .samples file that easy_handeye2 saves: a list `samples` of robot and tracking. tracking_base_frame must "
    "be the camera's optical frame (z forward, x right, y down)."
)


@dataclass(frozen=True)
class PoseFrame:
    """A frame: its name in messages, and its pose in the world."""

    words: str = "the world frame"
    T_world_frame: Pose = field(default_factory=lambda: np.eye(4))

    @property
    def is_world(self) -> bool:
        """Whether this is the world frame by another name."""
        return bool(np.allclose(self.T_world_frame, np.eye(4)))


def base_frame(arm: ArmDescription, turn_deg: float = 0.0) -> PoseFrame:
    """Return the frame that carries the arm's first joint, turned by `turn_deg` about its z axis."""
    T = arm.T_world_base @ make_pose(Rotation.from_euler("z", turn_deg, degrees=True).as_matrix())
    x, y, z = T[:3, 3] + 0.0
    yaw_deg = round(float(np.rad2deg(np.arctan2(T[1, 0], T[0, 0]))))
    stands = f"x {x:.3f}, y {y:.3f}, z {z:.3f} m of the world frame, turned by {yaw_deg} degrees about z"
    return PoseFrame(f"the robot's base frame, which stands at {stands}", T)


def views_of_pictures(
    poses: Path, pictures: Path, board: Board, frame: PoseFrame | None
) -> tuple[list[BoardView], tuple[int, int]]:
    """Return the views whose picture shows the board, and the pictures' width and height.

    Args:
        poses: file with the list of the flange's poses; the views hold them in the world frame.
        pictures: folder of the pictures.
        board: the board in them.
        frame: frame of the poses that are not named T_world_tool0; None refuses those poses.

    Raises InputError and LabError.
    """
    text = read_plain_text(poses, _MAX_BYTES, "the list of poses")
    if poses.suffix == ".csv":
        entries: Any = list(csv.DictReader(io.StringIO(text), skipinitialspace=True))
    elif text.lstrip().startswith("["):
        try:
            entries = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{poses} is not readable JSON: {error}. {_HOW}") from None
    else:
        entries = read_mapping(poses, "list of poses", _HOW).get("poses")
    views: list[BoardView] = []
    sizes: set[tuple[int, int]] = set()
    for where, entry in _entries(poses, entries, {"picture"}, _HOW):
        name = Path(str(entry["picture"]))
        if name.is_absolute() or ".." in name.parts:
            raise InputError(f"{where}: picture '{name}' is no name inside {pictures}.")
        flange, path = _flange(where, entry, frame), pictures / name
        gray = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if path.is_file() else None
        if gray is None:
            raise InputError(f"{where}: {path} is missing, or not a picture: give .png or .jpg files.")
        sizes.add((gray.shape[1], gray.shape[0]))
        if len(sizes) > 1:
            raise InputError(f"{path} is of another size than the pictures before it: one camera, one size.")
        if (found := board.find(np.asarray(gray, np.uint8))) is not None:
            views.append(BoardView(flange, found))
    return views, sizes.pop()


def samples_of_easy_handeye(path: Path, mounting: Mounting, frame: PoseFrame) -> list[PoseView]:
    """Return the samples, with the flange's poses in the world; the file has them in `frame`, the robot_base_frame.

    For a fixed camera easy_handeye stores the base's pose in the hand, not the hand's in the base.

    Raises InputError if the file is unreadable, has another form, or does not use the camera's optical frame.
    """
    samples = read_mapping(path, "list of samples", _SAMPLES_HOW).get("samples")
    views = []
    for where, sample in _entries(path, samples, {"robot", "tracking"}, _SAMPLES_HOW):
        robot, seen = (checked_pose(where, sample[name], _SAMPLES_HOW) for name in ("robot", "tracking"))
        if seen[2, 3] <= 0:
            raise InputError(
                f"{where}: the marker lies behind the camera (z = {seen[2, 3]:.3f} m). {_SAMPLES_HOW}"
            )
        flange = invert(robot) if mounting == "fixed" else robot
        views.append(PoseView(frame.T_world_frame @ flange, seen, np.diag(_SAMPLE_VARIANCE)))
    return views


def _entries(path: Path, given: Any, keys: set[str], how: str) -> list[tuple[str, Mapping[Any, Any]]]:
    """Return each entry and its name for messages. Raises InputError if there are none, or one lacks a key."""
    if not isinstance(given, list) or not 1 <= len(given) <= _MAX_ENTRIES:
        raise InputError(f"{path} holds no list of 1 to {_MAX_ENTRIES} entries. {how}")
    found = [(f"{path}, entry {k + 1}", entry) for k, entry in enumerate(given)]
    for where, entry in found:
        if not isinstance(entry, dict) or not keys <= entry.keys():
            raise InputError(f"{where}: needs {' and '.join(sorted(keys))}. {how}")
    return found


def _flange(where: str, entry: Mapping[Any, Any], frame: PoseFrame | None) -> Pose:
    """Return the flange's pose in the world."""
    if _IN_WORLD in entry:
        return checked_pose(where, entry[_IN_WORLD], _HOW)
    pose = checked_pose(where, {k: v for k, v in entry.items() if k != "picture"}, _HOW)
    if frame is None:
        raise InputError(
            f"{where}: in which frame? This robot's base is not the world frame. Add --frame base (what controllers, "
            f"TF and easy_handeye give) or --frame world, or name the poses {_IN_WORLD}."
        )
    return np.asarray(frame.T_world_frame @ pose)
