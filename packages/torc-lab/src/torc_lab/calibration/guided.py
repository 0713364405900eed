"""A calibration that torc leads: a person brings board and camera before each other once, and torc moves the arm from
pose to pose.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose
from torc.motion.space import FreeSpace
from torc.robots.protocols import Arm
from torc_lab.calibration.board import Board
from torc_lab.calibration.board_views import board_in_camera
from torc_lab.calibration.hand_eye import LEAST_VIEWS
from torc_lab.calibration.noisy_arm import Mounting
from torc_lab.calibration.proposals import Sight, calibration_space, proposed, tour
from torc_lab.calibration.session import Album, Photographer, take_view
from torc_lab.calibration.turns import room_around_hand, rough_camera, small_turns
from torc_lab.cameras.poses import LEVEL, read_pose
from torc_lab.devices import limits, planned_for
from torc_lab.empty_table import empty_space, motion_above, trusting
from torc_lab.lab_file import Lab
from torc_lab.person import Ask
from torc_lab.protocols import LabError

_SPARE = 10
_MISSES = 4
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


def collect_guided(
    lab: Lab,
    camera: Photographer,
    arm: Arm,
    board: Board,
    count: int,
    ask: Ask,
    say: Callable[[str], None],
    mounting: Mounting = "fixed",
) -> Album:
    """Pictures of the board at up to `count` poses that torc proposes; each motion is asked for. A "no" ends it.

    Raises LabError for a board in a mirror, one that no pose is found for, and one that is not where it should be; and
    as the arm does. Raises InputError if there are too few pictures in the end.
    """
    session = _Session(lab, camera, arm, board, count, ask, say, mounting)
    album = session.album
    while not album.views:
        if not ask(_FIRST[mounting]):
            album.check()
        session.look()
    sight = session.sight()
    if sight is not None:
        poses = proposed(sight, count + _SPARE, session.rng)
        if len(poses) < LEAST_VIEWS:
            raise LabError(
                f"{len(poses)} poses were found at which the board is in sight and the arm touches nothing. "
                f"{_HIGHER[mounting]}; or bring the arm to every pose yourself: --jog."
            )
        wanted = count - len(album.views)
        best = poses[:wanted]
        session.visit(calibration_space(sight), [*best[tour(best, arm.qpos)], *poses[wanted:]], lost=True)
    album.check()
    return album


@dataclass
class _Session:
    """One calibration: who takes part, and the pictures so far."""

    lab: Lab
    camera: Photographer
    arm: Arm
    board: Board
    count: int
    ask: Ask
    say: Callable[[str], None]
    mounting: Mounting
    album: Album = field(default_factory=Album)
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def look(self) -> bool:
        """Take a picture; returns whether the board was in it."""
        arm = self.lab.robot.arm
        return take_view(self.album, self.camera, lambda: self.arm.qpos, arm, self.board, self.say)

    def sight(self) -> Sight | None:
        """Return what is roughly known after the first picture; None after a "no"."""
        first, seen = self.arm.qpos, board_in_camera(self.album.views[0], self.board, self.album.K)
        if self.mounting == "fixed":
            T_camera = _rough_pose(self.lab)
        elif self._turned(float(seen[2, 3])):
            T_camera = rough_camera(self.album.views, self.board, self.album.K)
        else:
            return None
        lab, album = self.lab, self.album
        around = planned_for(lab), lab.workspace, limits(lab), self.board, album.K, album.size
        return Sight(*around, T_camera, seen, first, self.mounting)

    def _turned(self, ahead_m: float) -> bool:
        """Turn the hand a little, several ways, and look. Returns False after a "no"."""
        robot, within = planned_for(self.lab), limits(self.lab)
        around = empty_space(robot, self.lab.workspace, within, room_around_hand(robot))
        space = trusting(around, self.arm.qpos)
        return self.visit(space, small_turns(robot, within, self.arm.qpos, ahead_m))

    def visit(self, space: FreeSpace, goals: Iterable[Float[np.ndarray, "dof"]], lost: bool = False) -> bool:
        """Go to one goal after the other and look, until there are enough pictures. Returns False after a "no". With
        `lost`, raises LabError if the board is out of sight several times in a row.
        """
        misses = 0
        for goal in goals:
            if len(self.album.views) >= self.count:
                break
            motion = motion_above(space, planned_for(self.lab).arm, self.arm.qpos, goal[None], self.rng)
            if motion is None:
                continue
            turn = np.abs(motion.qpos[-1] - motion.qpos[0]).max()
            number = len(self.album.views) + 1
            if not self.ask(f"Picture {number} of {self.count}: joints turn by up to {turn:.2f} rad. Go?"):
                return False
            self.arm.follow(motion)
            misses = 0 if self.look() else misses + 1
            if lost and misses == _MISSES:
                raise LabError(f"The board was not in sight {_MISSES} times in a row: {_LOST[self.mounting]}")
        return True


def _rough_pose(lab: Lab) -> Pose:
    """Where a fixed camera is as far as is known: by the lab file, else by the workspace."""
    told = read_pose(lab.conditions.settings.get("camera.pose", LEVEL), lab.workspace)
    return lab.workspace.camera.T_world_camera if told is None else told
