"""A calibration that torc leads: a person holds the board up once, and torc moves it from pose to pose."""

from collections.abc import Callable

import numpy as np

from torc.cameras.poses import LEVEL, read_pose
from torc.geometry.transforms import Pose
from torc.lab.calibration.board import Board
from torc.lab.calibration.board_views import board_in_camera
from torc.lab.calibration.hand_eye import LEAST_VIEWS
from torc.lab.calibration.proposals import Sight, calibration_space, proposed, tour
from torc.lab.calibration.session import Album, Photographer, take_view
from torc.lab.devices import limits, planned_for
from torc.lab.empty_table import motion_above
from torc.lab.lab_file import Lab
from torc.lab.person import Ask
from torc.lab.protocols import LabError
from torc.robots.protocols import Arm

_SPARE = 10
_MISSES = 4
_FIRST = (
    "Clear the table. Put the board into the gripper so that it cannot slip. Bring the arm by its pendant to where the "
    "board faces the camera, in the middle of the picture, half a metre away, and high above the table. Ready?"
)


def collect_guided(
    lab: Lab,
    camera: Photographer,
    arm: Arm,
    board: Board,
    count: int,
    ask: Ask,
    say: Callable[[str], None],
) -> Album:
    """Pictures of the board at up to `count` poses that torc proposes; each motion is asked for. A "no" ends it.

    Raises LabError for a board in a mirror, one that no pose is found for, and one that is not where it should be; and
    as the arm does. Raises InputError if there are too few pictures in the end.
    """
    album, rng = Album(), np.random.default_rng(0)
    while not album.views:
        if not ask(_FIRST):
            album.check()
        take_view(album, camera, lambda: arm.qpos, lab.robot.arm, board, say)
    sight = _sight(lab, album, arm, board)
    poses = proposed(sight, count + _SPARE, rng)
    if len(poses) < LEAST_VIEWS:
        raise LabError(
            f"{len(poses)} poses were found at which the board is in sight and the arm touches nothing. Hold it "
            "higher, nearer to the middle of the picture, or otherwise; or bring the arm to every pose yourself: --jog."
        )
    best = poses[: count - 1]
    ordered = [*best[tour(best, arm.qpos)], *poses[count - 1 :]]
    space, misses = calibration_space(sight), 0
    for goal in ordered:
        if len(album.views) >= count:
            break
        motion = motion_above(space, sight.robot.arm, arm.qpos, goal[None], rng)
        if motion is None:
            continue
        turn = np.abs(motion.qpos[-1] - motion.qpos[0]).max()
        if not ask(f"Picture {len(album.views) + 1} of {count}: joints turn by up to {turn:.2f} rad. Go?"):
            break
        arm.follow(motion)
        misses = 0 if take_view(album, camera, lambda: arm.qpos, lab.robot.arm, board, say) else misses + 1
        if misses == _MISSES:
            raise LabError(
                f"The board was not in sight {_MISSES} times in a row: the camera is not where the workspace, or "
                "camera.pose, says, or the board has slipped. Set it about right, or use --jog."
            )
    album.check()
    return album


def _sight(lab: Lab, album: Album, arm: Arm, board: Board) -> Sight:
    in_camera = board_in_camera(album.views[0], board, album.K)
    around = planned_for(lab), lab.workspace, limits(lab), board, album.K, album.size
    return Sight(*around, _rough_pose(lab), in_camera, arm.qpos)


def _rough_pose(lab: Lab) -> Pose:
    """Where the camera is as far as is known: by the lab file, else by the workspace."""
    told = read_pose(lab.conditions.settings.get("camera.pose", LEVEL), lab.workspace)
    return lab.workspace.camera.T_world_camera if told is None else told
