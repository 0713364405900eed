"""`torc lab board` and `torc lab calibrate`: where the camera is."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from torc import InputError

if TYPE_CHECKING:
    from torc_lab.calibration.board import Board
    from torc_lab.calibration.hand_eye import HandEye
    from torc_lab.calibration.marker import TableMarker
    from torc_lab.calibration.session import Session
    from torc_lab.calibration.stored import PoseFrame
    from torc_lab.lab_file import Lab


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
        """Return the board. Raises InputError if its measures are not valid."""
        from torc_lab.calibration.board import Board

        return Board(self.columns, self.rows, self.square_m, self.marker_m)


@dataclass(frozen=True)
class BoardCommand:
    """Write a ChArUco board to print, for `torc lab calibrate`; and a marker for the table, by which `torc lab check`
    notices that the camera has moved since."""

    out: Path = Path("board.pdf")
    """A .pdf or .png file."""
    options: tyro.conf.OmitArgPrefixes[BoardOptions] = field(default_factory=BoardOptions)

    def run(self) -> int:
        """Write the board; return the exit code."""
        from torc_lab.calibration.printing import write_board

        files = " and ".join(map(str, write_board(self.options.board(), self.out)))
        print(f"{files}: the board, and a marker for the table. Print them at 100 %, and measure a square.")
        return 0


@dataclass(frozen=True)
class CalibrateCommand:
    """Find out where the camera is: fixed, with the board in the robot's hand; or on the hand (--mount hand), with the
    board on the table.

    Bring the arm to one pose at which the camera sees the board. torc proposes the others, asks before each motion,
    and takes a picture at each pose. With --jog you bring the arm to every pose by its pendant, and torc moves nothing.
    Then it says how well the camera is known, in millimetres at poses that were left out, and how noisy the arm seems,
    and writes a file for the lab file's camera.pose. --poses-file and --samples read what was recorded elsewhere:
    nothing is connected then.
    """

    lab: tyro.conf.Positional[Path]
    """The lab file."""
    out: Path = Path("calibration.yaml")
    """Where the camera's pose is written."""
    poses: int = 20
    """Number of pictures."""
    jog: bool = False
    """Bring the arm from pose to pose by its pendant; torc moves nothing."""
    mount: Literal["fixed", "hand"] = "fixed"
    """fixed: the arm holds the board. hand: the arm carries the camera, the board lies on the table."""
    poses_file: Path | None = None
    """A list of pictures with the flange's poses (.csv, .json, .yaml); with --pictures and --intrinsics."""
    pictures: Path | None = None
    """The directory of those pictures."""
    intrinsics: tuple[float, float, float, float] | None = None
    """fx, fy, cx, cy of those pictures, pixels; without distortion."""
    samples: Path | None = None
    """Samples that easy_handeye2 saved (.samples)."""
    frame: Literal["base", "world"] | None = None
    """In which frame the flange's poses of --poses-file or --samples are: the robot's base, as controllers, TF and
    easy_handeye give them, or the world, that of table and camera. --samples are in the base if not given."""
    base_turn_deg: float = 0.0
    """Turn of that base frame about z against the modelled one: 180 for base_link of ROS on Universal Robots' arms."""
    options: tyro.conf.OmitArgPrefixes[BoardOptions] = field(default_factory=BoardOptions)

    def run(self) -> int:
        """Calibrate; return the exit code."""
        self._check()
        self.out.parent.mkdir(parents=True, exist_ok=True)
        with self.out.open("a"):  # twenty pictures later is too late to learn that it cannot be written
            pass
        if self.samples is not None:
            self._by_samples(self.samples)
        elif self.poses_file is not None and self.pictures is not None and self.intrinsics is not None:
            self._by_pictures(self.poses_file, self.pictures, self.intrinsics)
        else:
            self._by_arm()
        return 0

    def _check(self) -> None:
        """Raise InputError if options contradict each other, or one that belongs to others is missing."""
        from torc_lab.calibration.hand_eye import LEAST_VIEWS

        stored = (self.poses_file, self.pictures, self.intrinsics)
        if any(v is not None for v in stored) and any(v is None for v in stored):
            raise InputError(
                "--poses-file, --pictures and --intrinsics FX FY CX CY belong together: give all three."
            )
        if self.samples is not None and self.poses_file is not None:
            raise InputError("--samples and --poses-file are two ways: give one of them.")
        if self.poses < LEAST_VIEWS:
            raise InputError(f"--poses {self.poses} are too few: at least {LEAST_VIEWS}, better 20.")
        if self.samples is None and self.poses_file is None and (self.frame or self.base_turn_deg):
            raise InputError("--frame and --base-turn-deg are for --poses-file and --samples.")

    def _by_arm(self) -> None:
        from torc_lab.calibration.hand_eye import solve_hand_eye
        from torc_lab.calibration.marker import placed_marker
        from torc_lab.lab_file import load_lab

        lab, board = load_lab(self.lab), self.options.board()
        session = self._session(lab, board)
        found = solve_hand_eye(session.views, board, session.K, self.mount)
        fixed = self.mount == "fixed"
        marker = placed_marker(session.markers, session.K, found.T_camera) if fixed else None
        self._write(found, len(session.views), marker)
        if fixed and marker is None:
            print(
                "No marker was seen on the table: `torc lab check` will not notice a camera that was moved."
            )

    def _by_pictures(self, poses: Path, pictures: Path, numbers: tuple[float, float, float, float]) -> None:
        import numpy as np

        from torc.pipeline.frames.plausibility import check_intrinsics
        from torc_lab.calibration.hand_eye import solve_hand_eye
        from torc_lab.calibration.stored import views_of_pictures

        board, frame = self.options.board(), self._frame()
        # A list does not say in which frame its poses are: that has to be given, or be the only one that there is.
        known = frame if self.frame or frame.is_world else None
        views, (width, height) = views_of_pictures(poses, pictures, board, known)
        fx, fy, cx, cy = numbers
        K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        check_intrinsics("--intrinsics", K, (height, width))
        self._write(solve_hand_eye(views, board, K, self.mount), len(views))
        if known is not None:
            print(f"Poses not named T_world_tool0 were read in {known.words}.")

    def _by_samples(self, path: Path) -> None:
        from torc_lab.calibration.hand_eye import solve_samples
        from torc_lab.calibration.stored import samples_of_easy_handeye

        frame = self._frame()
        samples = samples_of_easy_handeye(path, self.mount, frame)
        self._write(solve_samples(samples, self.mount), len(samples))
        print(f"The samples' robot_base_frame was taken to be {frame.words}.")

    def _frame(self) -> PoseFrame:
        """Return the frame of recorded poses, the base unless --frame says otherwise."""
        from torc_lab.calibration.stored import PoseFrame, base_frame
        from torc_lab.lab_file import load_lab

        if self.frame == "world":
            return PoseFrame()
        return base_frame(load_lab(self.lab).robot.arm, self.base_turn_deg)

    def _write(self, found: HandEye, count: int, marker: TableMarker | None = None) -> None:
        self.out.write_text(found.as_yaml(count, marker), encoding="utf-8")
        print(found.report(str(self.out)))

    def _session(self, lab: Lab, board: Board) -> Session:
        from torc_lab.calibration.session import Session, collect_guided, collect_views
        from torc_lab.cameras.kinds import open_camera
        from torc_lab.devices import close_camera, connect_arm, limits, stop_and_close
        from torc_lab.person import ask_in_terminal
        from torc_lab.supervisor import SupervisedArm

        with ExitStack() as stack:
            camera = open_camera(lab.conditions)
            stack.callback(close_camera, camera)
            driver = connect_arm(lab)
            stack.callback(stop_and_close, driver)
            arm, modelled = SupervisedArm(driver, lab.robot, limits(lab)), lab.robot.arm
            where = lambda: arm.qpos  # noqa: E731
            session = Session(camera, where, modelled, board, self.poses, ask_in_terminal, print, self.mount)
            if self.jog:
                collect_views(session)
            else:
                collect_guided(session, lab, arm)
            return session
