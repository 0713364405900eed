"""A calibration as a person does it: pictures of the board at poses of the arm, then where the camera is."""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import date
from typing import Any, Protocol

import cv2
import numpy as np
import yaml
from jaxtyping import Float

from torc import InputError, Observation
from torc.geometry.transforms import Pose
from torc.robots.description import ArmDescription
from torc.robots.kinematics import tool0_poses
from torc_lab.calibration.board import Board
from torc_lab.calibration.board_views import BoardView
from torc_lab.calibration.hand_eye import LEAST_VIEWS, HandEye
from torc_lab.calibration.marker import TableMarker, find_marker
from torc_lab.calibration.noisy_arm import Mounting
from torc_lab.cameras.poses import ON_HAND
from torc_lab.person import Ask

_STILL_RAD = 0.002
_WORN_RAD, _WORN_M = float(np.deg2rad(0.15)), 0.0015
_ADVICE = (
    "turn the hand by 20 to 35 degrees about several axes, and show the board near and far, in the middle and near "
    "the picture's edges"
)
_PLACE: dict[Mounting, str] = {
    "fixed": "Hold the board in the gripper or flange, in sight of the camera.",
    "hand": "Lay the board on the table, where it cannot slip, in sight of the camera on the hand.",
}


class Photographer(Protocol):
    """A camera, as all of torc.cameras."""

    def unplaced(self) -> Observation:
        """One snapshot in the camera's own frame."""


@dataclass
class Album:
    """Pictures of the board that were taken.

    Attributes:
        views: one per picture that showed the board.
        markers: corners of the marker on the table, in those pictures that showed it.
        K: intrinsics of the camera.
        size: width and height of a picture, pixels.
    """

    views: list[BoardView] = field(default_factory=list)
    markers: list[Float[np.ndarray, "4 2"]] = field(default_factory=list)
    K: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))
    size: tuple[int, int] = (0, 0)

    def check(self) -> None:
        """Raises InputError if there are too few."""
        if len(self.views) < LEAST_VIEWS:
            raise InputError(f"{len(self.views)} pictures are too few: at least {LEAST_VIEWS}, better 20.")


def take_view(
    album: Album,
    camera: Photographer,
    qpos: Callable[[], Float[np.ndarray, "dof"]],
    arm: ArmDescription,
    board: Board,
    say: Callable[[str], None],
) -> bool:
    """Takes a picture into the album; whether the board was in it. Raises LabError for a board in a mirror."""
    before = qpos()
    seen = camera.unplaced()
    if np.abs(qpos() - before).max() > _STILL_RAD:
        say("The arm moved while the picture was taken; once more.")
        return False
    gray = cv2.cvtColor(seen.rgb, cv2.COLOR_RGB2GRAY)
    album.K, album.size = seen.K, (gray.shape[1], gray.shape[0])
    found = board.find(gray)
    if found is None:
        say("The board is not in sight, or too little of it.")
        return False
    album.views.append(BoardView(tool0_poses(arm, before[None])[0], found))
    if (marker := find_marker(gray)) is not None:
        album.markers.append(marker)
    say(f"{len(found.ids)} of {len(board.corners)} corners found.")
    return True


def collect_views(
    camera: Photographer,
    qpos: Callable[[], Float[np.ndarray, "dof"]],
    arm: ArmDescription,
    board: Board,
    count: int,
    ask: Ask,
    say: Callable[[str], None],
    mounting: Mounting = "fixed",
) -> Album:
    """Pictures of the board, one per pose to which a person brings the arm.

    Raises LabError for a board in a mirror, and InputError if the person ends it before there are enough.
    """
    album = Album()
    say(f"{_PLACE[mounting]} Between pictures {_ADVICE}.")
    while len(album.views) < count:
        if not ask(f"Picture {len(album.views) + 1} of {count}: is the arm at another pose, at rest?"):
            break
        take_view(album, camera, qpos, arm, board, say)
    album.check()
    return album


def calibration_text(found: HandEye, count: int, marker: TableMarker | None = None) -> str:
    """The file of a calibration; of a fixed camera, a lab file's camera.pose names it."""
    name, board = (
        ("T_world_camera", "T_tool0_board") if found.mounting == "fixed" else (ON_HAND, "T_world_board")
    )
    content: dict[str, Any] = {
        name: _rows(found.T_camera),
        board: _rows(found.T_board),
        "date": date.today().isoformat(),
        "pictures": count,
        "error_mm": round(1e3 * found.error_m, 2),
        "arm_noise_mm": round(1e3 * found.noise.shift_m, 2),
        "arm_noise_deg": round(float(np.rad2deg(found.noise.turn_rad)), 3),
    }
    if found.rms_px is not None:
        content["rms_px"] = round(found.rms_px, 2)
    if marker is not None:
        content["marker_corners"] = [[round(float(v), 6) for v in corner] for corner in marker.corners]
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None)


def report(found: HandEye, file: str) -> str:
    """What a person is shown after a calibration."""
    noise = found.noise
    lines = [
        f"At poses that were left out, corners are {1e3 * found.error_m:.1f} mm off (median; worst "
        f"{1e3 * found.errors_m.max():.1f} mm).",
        f"The arm seems to be off by {1e3 * noise.shift_m:.1f} mm and {np.rad2deg(noise.turn_rad):.2f} degrees at each "
        "pose; views were weighed by that.",
    ]
    if noise.shift_m > _WORN_M or noise.turn_rad > _WORN_RAD:
        lines.append(
            "That is much: the arm is worn, its model is not exact, or the board or camera is loose."
        )
    if found.mounting == "fixed":
        x, y, z = found.T_camera[:3, 3]
        lines.append(
            f"The camera is at x {x:.3f}, y {y:.3f}, z {z:.3f} m of the world frame: does it stand there?"
        )
        lines.append(f"{file} is written: name it in the lab file as camera.pose.")
    else:
        lines.append(
            f"{file} is written: {ON_HAND}, the camera in the flange's frame. It is no camera.pose: that is for a "
            "fixed camera."
        )
    return "\n".join(lines)


def _rows(T: Pose) -> list[list[float]]:
    return [[round(float(v), 7) for v in row] for row in T]
