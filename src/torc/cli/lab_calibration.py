"""`torc lab board` and `torc lab calibrate`: where the camera is."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from torc.errors import InputError

if TYPE_CHECKING:
    from torc.lab.calibration.board import Board
    from torc.lab.calibration.session import Album
    from torc.lab.lab_file import Lab


@dataclass(frozen=True)
class BoardOptions:
    """The ChArUco board."""

    columns: int = 7
    """Squares side by side."""
    rows: int = 5
    """Squares one above the other."""
    square_m: float = 0.03
    """Side of a square, metres, as measured on the print."""
    marker_m: float = 0.022
    """Side of a marker."""

    def board(self) -> Board:
        """The board. Raises InputError."""
        from torc.lab.calibration.board import Board

        return Board(self.columns, self.rows, self.square_m, self.marker_m)


@dataclass(frozen=True)
class BoardCommand:
    """Write a ChArUco board to print, for `torc lab calibrate`; and a marker for the table, by which `torc lab check`
    notices that the camera has moved since."""

    out: Path = Path("board.pdf")
    """A .pdf or .png file."""
    options: tyro.conf.OmitArgPrefixes[BoardOptions] = field(default_factory=BoardOptions)

    def run(self) -> int:
        """Write it."""
        from torc.lab.calibration.printing import write_board

        files = " and ".join(map(str, write_board(self.options.board(), self.out)))
        print(f"{files}: the board, and a marker for the table. Print them at 100 %, and measure a square.")
        return 0


@dataclass(frozen=True)
class CalibrateCommand:
    """Find out where the camera is: the board in the robot's hand, the camera fixed.

    Bring the arm to one pose at which the board faces the camera. torc proposes the others, asks before each motion,
    and takes a picture at each pose. With --jog you bring the arm to every pose by its pendant, and torc moves nothing.
    Then it says how well the camera is known, in millimetres at poses that were left out, and writes a file for the lab
    file's camera.pose.
    """

    lab: tyro.conf.Positional[Path]
    """The lab file."""
    out: Path = Path("calibration.yaml")
    """Where the camera's pose is written."""
    poses: int = 20
    """So many pictures."""
    jog: bool = False
    """Bring the arm from pose to pose by its pendant; torc moves nothing."""
    options: tyro.conf.OmitArgPrefixes[BoardOptions] = field(default_factory=BoardOptions)

    def run(self) -> int:
        """Calibrate."""
        from torc.lab.calibration.hand_eye import LEAST_VIEWS, solve_hand_eye
        from torc.lab.calibration.marker import placed_marker
        from torc.lab.calibration.session import calibration_text
        from torc.lab.lab_file import load_lab

        if self.poses < LEAST_VIEWS:
            raise InputError(f"--poses {self.poses} are too few: at least {LEAST_VIEWS}, better 20.")
        lab, board = load_lab(self.lab), self.options.board()
        self.out.parent.mkdir(parents=True, exist_ok=True)
        with self.out.open("a"):  # twenty pictures later is too late to learn that it cannot be written
            pass
        album = self._album(lab, board)
        found = solve_hand_eye(album.views, board, album.K, "fixed")
        marker = placed_marker(album.markers, album.K, found.T_camera)
        self.out.write_text(calibration_text(found, len(album.views), marker), encoding="utf-8")
        print(
            f"At poses that were left out, corners are {1e3 * found.error_m:.1f} mm off (median; worst "
            f"{1e3 * found.errors_m.max():.1f} mm). {self.out} is written: name it in the lab file as camera.pose."
        )
        if marker is None:
            print(
                "No marker was seen on the table: `torc lab check` will not notice a camera that was moved."
            )
        return 0

    def _album(self, lab: Lab, board: Board) -> Album:
        from torc.cameras.kinds import open_camera
        from torc.lab.calibration.guided import collect_guided
        from torc.lab.calibration.session import collect_views
        from torc.lab.devices import close_camera, connect_arm, limits, stop_and_close
        from torc.lab.person import ask_in_terminal
        from torc.lab.supervisor import SupervisedArm

        with ExitStack() as stack:
            camera = open_camera(lab.conditions)
            stack.callback(close_camera, camera)
            driver = connect_arm(lab)
            stack.callback(stop_and_close, driver)
            if self.jog:
                arm = lab.robot.arm
                where = lambda: driver.status().qpos  # noqa: E731
                return collect_views(camera, where, arm, board, self.poses, ask_in_terminal, print)
            supervised = SupervisedArm(driver, lab.robot, limits(lab))
            return collect_guided(lab, camera, supervised, board, self.poses, ask_in_terminal, print)
