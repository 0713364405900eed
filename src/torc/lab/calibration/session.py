"""A calibration as a person does it: pictures of the board at poses of the arm, then where the camera is."""

from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
import yaml
from jaxtyping import Float
from PIL import Image, ImageDraw, ImageFont

from torc.errors import InputError
from torc.lab.calibration.board import Board
from torc.lab.calibration.hand_eye import LEAST_VIEWS, BoardView, HandEye
from torc.lab.person import Ask
from torc.records import Observation
from torc.robots.description import ArmDescription
from torc.robots.kinematics import tool0_poses

_STILL_RAD = 0.002
_ADVICE = (
    "turn the hand by 20 to 35 degrees about several axes, and show the board near and far, in the middle and near "
    "the picture's edges"
)


class Photographer(Protocol):
    """A camera, as all of torc.cameras."""

    def unplaced(self) -> Observation:
        """One snapshot in the camera's own frame."""


def collect_views(
    camera: Photographer,
    qpos: Callable[[], Float[np.ndarray, "dof"]],
    arm: ArmDescription,
    board: Board,
    count: int,
    ask: Ask,
    say: Callable[[str], None],
) -> tuple[list[BoardView], Float[np.ndarray, "3 3"]]:
    """Pictures of the board, one per pose to which a person brings the arm, and the camera's intrinsics.

    Raises LabError for a board in a mirror, and InputError if the person ends it before there are enough.
    """
    views: list[BoardView] = []
    K = np.eye(3)
    say(f"Hold the board in the gripper or flange, in sight of the camera. Between pictures {_ADVICE}.")
    while len(views) < count:
        if not ask(f"Picture {len(views) + 1} of {count}: is the arm at another pose, at rest?"):
            break
        before = qpos()
        seen = camera.unplaced()
        if np.abs(qpos() - before).max() > _STILL_RAD:
            say("The arm moved while the picture was taken; once more.")
            continue
        K = seen.K
        found = board.find(cv2.cvtColor(seen.rgb, cv2.COLOR_RGB2GRAY))
        if found is None:
            say("The board is not in sight, or too little of it.")
            continue
        views.append(BoardView(tool0_poses(arm, before[None])[0], found))
        say(f"{len(found.ids)} of {len(board.corners)} corners found.")
    if len(views) < LEAST_VIEWS:
        raise InputError(f"{len(views)} pictures are too few: at least {LEAST_VIEWS}, better 20.")
    return views, K


def calibration_text(found: HandEye, count: int) -> str:
    """The file that a lab file's camera.pose names."""
    content: dict[str, Any] = {
        "T_world_camera": [[round(float(v), 7) for v in row] for row in found.T_camera],
        "date": date.today().isoformat(),
        "pictures": count,
        "error_mm": round(1e3 * found.error_m, 2),
        "rms_px": round(found.rms_px, 2),
    }
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None)


def write_board(board: Board, path: Path, dpi: int = 600) -> None:
    """The board as a page to print, A4 or larger, with a line of 100 mm to be measured. Raises InputError."""
    if path.suffix.lower() not in (".pdf", ".png"):
        raise InputError(f"The board is written as .pdf or .png, not '{path.suffix}'.")
    per_m = dpi / 0.0254
    margin = 0.02
    page = [max(size, board_size + 2 * margin) for size, board_size in zip((0.297, 0.210), board.size_m)]
    width, height = (round(v * per_m) for v in page)
    sheet = Image.new("L", (width, height), 255)
    picture = Image.fromarray(board.picture(per_m))
    left, top = (width - picture.width) // 2, (height - picture.height) // 2
    sheet.paste(picture, (left, top))
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(round(0.0035 * per_m))
    line = top + picture.height + round(0.007 * per_m)
    draw.line([(left, line), (left + round(0.1 * per_m), line)], fill=0, width=round(0.0004 * per_m))
    told = (
        f"This line is 100 mm long, each square {1e3 * board.square_m:g} mm. Print at 100 %, glue it to something "
        "flat, and measure both."
    )
    draw.text((left, line + round(0.002 * per_m)), told, fill=0, font=font)
    sheet.save(path, resolution=dpi)
