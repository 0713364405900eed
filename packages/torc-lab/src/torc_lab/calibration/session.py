"""Run a calibration with a person, who brings the arm to every pose, or only to the first."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import cv2
import numpy as np
from jaxtyping import Float

from torc import InputError
from torc.motion.space import FreeSpace
from torc.robots.description import ArmDescription
from torc.robots.kinematics import tool0_poses
from torc.robots.protocols import Arm
from torc_lab.calibration.board import Board, BoardView, board_in_camera
from torc_lab.calibration.hand_eye import LEAST_VIEWS
from torc_lab.calibration.marker import find_marker
from torc_lab.calibration.noisy_arm import Mounting
from torc_lab.calibration.proposals import (
    Sight,
    calibration_space,
    proposed,
    room_around_hand,
    rough_camera,
    small_turns,
    tour,
)
from torc_lab.cameras.base import RealCamera
from torc_lab.cameras.poses import LEVEL, read_pose
from torc_lab.devices import limits, planned_for
from torc_lab.empty_table import empty_space, motion_above, trusting
from torc_lab.lab_file import Lab
from torc_lab.person import Ask
from torc_lab.protocols import LabError

_STILL_RAD = 0.002
_SPARE = 10
_MISSES = 4
_ADVICE = (
    "turn the hand by 20 to 35 degrees about several axes, and show the board near and far, in the middle and near "
    "the picture's edges"
)
_PLACE: dict[Mounting, str] = {
    "fixed": "Hold the board in the gripper or flange, in sight of the camera.",
    "hand": "Lay the board on the table, where it cannot slip, in sight of the camera on the hand.",
}
_FIRST: dict[Mounting, str] = {
    "fixed": "Clear the table. Put the board into the gripper so that it cannot slip. Bring the arm by its pendant to "
    "where the board faces the camera, in the middle of the picture, half a metre away, and high above the table. "
    "Ready?",
    "hand": "Clear the table, empty the hand, and lay the board flat on the table, where it cannot slip. Bring the arm "
    "by its pendant to where the camera on the hand sees the board in the middle of the picture, from half a metre "
    "above. Ready?",
}
_LOST: dict[Mounting, str] = {
    "fixed": "the camera is not where the workspace, or camera.pose, says, or the board has slipped. Set it about "
    "right, or use --jog.",
    "hand": "the board has slipped, or the camera is loose on the hand. Fix it, or use --jog.",
}
_HIGHER: dict[Mounting, str] = {
    "fixed": "Hold it higher, nearer to the middle of the picture, or otherwise",
    "hand": "Lay it elsewhere, or begin higher above it",
}


@dataclass
class Session:
    """The devices and people of a calibration, and the pictures of the board so far.

    Attributes:
        qpos: returns the arm's joint positions now, radians.
        count: how many pictures to take.
        say: shows the person a line.
        views: one per picture that showed the board.
        markers: corners of the marker on the table, in the pictures that showed it.
        K: intrinsics of the camera.
        size: width and height of a picture, pixels.
    """

    camera: RealCamera
    qpos: Callable[[], Float[np.ndarray, "dof"]]
    arm: ArmDescription
    board: Board
    count: int
    ask: Ask
    say: Callable[[str], None]
    mounting: Mounting = "fixed"
    views: list[BoardView] = field(default_factory=list)
    markers: list[Float[np.ndarray, "4 2"]] = field(default_factory=list)
    K: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))
    size: tuple[int, int] = (0, 0)
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def look(self) -> bool:
        """Take a picture; return whether it shows the board. Raises LabError if the board is mirrored."""
        before = self.qpos()
        seen = self.camera.unplaced()
        if np.abs(self.qpos() - before).max() > _STILL_RAD:
            self.say("The arm moved while the picture was taken; once more.")
            return False
        gray = cv2.cvtColor(seen.rgb, cv2.COLOR_RGB2GRAY)
        self.K, self.size = seen.K, (gray.shape[1], gray.shape[0])
        found = self.board.find(gray)
        if found is None:
            self.say("The board is not in sight, or too little of it.")
            return False
        self.views.append(BoardView(tool0_poses(self.arm, before[None])[0], found))
        if (marker := find_marker(gray)) is not None:
            self.markers.append(marker)
        self.say(f"{len(found.ids)} of {len(self.board.corners)} corners found.")
        return True

    def check(self) -> None:
        """Raise InputError if there are too few pictures."""
        if len(self.views) < LEAST_VIEWS:
            raise InputError(f"{len(self.views)} pictures are too few: at least {LEAST_VIEWS}, better 20.")


def collect_views(session: Session) -> None:
    """Take pictures of the board, one per pose to which a person brings the arm.

    Raises LabError if the board is mirrored, and InputError if the person ends it with too few pictures.
    """
    session.say(f"{_PLACE[session.mounting]} Between pictures {_ADVICE}.")
    while len(session.views) < session.count:
        number = f"Picture {len(session.views) + 1} of {session.count}"
        if not session.ask(f"{number}: is the arm at another pose, at rest?"):
            break
        session.look()
    session.check()


def collect_guided(session: Session, lab: Lab, arm: Arm) -> None:
    """Take pictures of the board at up to `count` poses that torc proposes.

    The person confirms each motion; a "no" ends it.

    Raises:
        LabError: the board is mirrored, too few poses are found, the board is not where it should be, or the arm fails.
        InputError: there are too few pictures in the end.
    """
    while not session.views:
        if not session.ask(_FIRST[session.mounting]):
            session.check()
        session.look()
    sight = _sight(session, lab, arm)
    if sight is not None:
        poses = proposed(sight, session.count + _SPARE, session.rng)
        if len(poses) < LEAST_VIEWS:
            raise LabError(
                f"{len(poses)} poses were found at which the board is in sight and the arm touches nothing. "
                f"{_HIGHER[session.mounting]}; or bring the arm to every pose yourself: --jog."
            )
        wanted = session.count - len(session.views)
        best = poses[:wanted]
        goals = [*best[tour(best, arm.qpos)], *poses[wanted:]]
        _visit(session, lab, arm, calibration_space(sight), goals, lost=True)
    session.check()


def _sight(session: Session, lab: Lab, arm: Arm) -> Sight | None:
    """Return the roughly known poses after the first picture; None after a "no"."""
    robot, within, first = planned_for(lab), limits(lab), arm.qpos
    seen = board_in_camera(session.views[0], session.board, session.K)
    if session.mounting == "fixed":
        pose = read_pose(lab.conditions.settings.get("camera.pose", LEVEL), lab.workspace)
        T_camera = lab.workspace.camera.T_world_camera if pose is None else pose
    else:  # turn the hand a little, several ways, and look
        around = empty_space(robot, lab.workspace, within, room_around_hand(robot))
        turns = small_turns(robot, within, first, float(seen[2, 3]))
        if not _visit(session, lab, arm, trusting(around, first), turns):
            return None
        T_camera = rough_camera(session.views, session.board, session.K)
    around_it = robot, lab.workspace, within, session.board, session.K, session.size
    return Sight(*around_it, T_camera, seen, first, session.mounting)


def _visit(
    session: Session,
    lab: Lab,
    arm: Arm,
    space: FreeSpace,
    goals: Iterable[Float[np.ndarray, "dof"]],
    lost: bool = False,
) -> bool:
    """Go from goal to goal and take pictures, until there are enough. Returns False after a "no".

    With `lost`, raises LabError if the board is out of sight several times in a row.
    """
    misses = 0
    for goal in goals:
        if len(session.views) >= session.count:
            break
        motion = motion_above(space, planned_for(lab).arm, arm.qpos, goal[None], session.rng)
        if motion is None:
            continue
        turn = np.abs(motion.qpos[-1] - motion.qpos[0]).max()
        number = f"Picture {len(session.views) + 1} of {session.count}"
        if not session.ask(f"{number}: joints turn by up to {turn:.2f} rad. Go?"):
            return False
        arm.follow(motion)
        misses = 0 if session.look() else misses + 1
        if lost and misses == _MISSES:
            raise LabError(f"The board was not in sight {_MISSES} times in a row: {_LOST[session.mounting]}")
    return True
