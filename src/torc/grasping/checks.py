"""Hard checks of candidates, on points.

The gripper is taken at its largest opening, as it arrives, and while it closes. What a candidate does to its own
object decides whether it is kept at all; what it does to *other* objects is only recorded: such grasps are
evidence of who blocks whom. Unknown space is never a veto.
"""

import numpy as np
from jaxtyping import Float

from torc.grasping.cells import PointCells
from torc.grasping.check_kernels import check_all
from torc.grasping.check_result import CORRIDOR_M, NEAR_M, CheckResult
from torc.grasping.config import CheckConfig
from torc.grasping.hand import HandGeometry
from torc.grasping.hand_volume import hand_bounds


def check_candidates(
    Rs: Float[np.ndarray, "n 3 3"],
    tips: Float[np.ndarray, "n 3"],
    widths_m: Float[np.ndarray, "n"],
    own: PointCells,
    own_id: int,
    cells: PointCells,
    hand: HandGeometry,
    support_z_m: float,
    config: CheckConfig,
) -> CheckResult:
    """Check the candidates of one object. Its points `own` are tagged 1 where they were seen;
    only those count."""
    n = len(widths_m)
    result = CheckResult(np.zeros(n, np.uint8), np.zeros(n, np.uint64), np.zeros((n, 5), np.int32))
    margins = np.array(
        [
            config.finger_margin_m,
            config.palm_margin_m,
            config.own_slack_m,
            config.table_margin_m,
            config.tip_margin_m,
            config.approach_m,
        ]
    )
    limits = np.array([config.max_own_in_fingers, config.min_points_between], dtype=np.int64)
    box = hand_bounds(hand, max(NEAR_M, config.finger_margin_m, config.palm_margin_m))
    box[0, 2] -= CORRIDOR_M
    check_all(
        Rs,
        tips,
        widths_m,
        own.points,
        own.tags,
        own.starts,
        own.centers,
        own.radii,
        own_id,
        cells.points,
        cells.tags,
        cells.starts,
        cells.centers,
        cells.radii,
        hand.sizes,
        hand.palm,
        hand.palm_ranges,
        hand.reach_m,
        box,
        palm_bounds(hand, config.palm_margin_m),
        support_z_m,
        margins,
        limits,
        result.fault,
        result.blockers,
        result.foreign,
    )
    return result


def palm_bounds(hand: HandGeometry, margin_m: float) -> Float[np.ndarray, "2 3"]:
    """Largest |x|, |y| and z of the palm boxes, in the second row; relative to the open gripper's TCP."""
    if len(hand.palm) == 0:
        return np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    upper = (np.abs(hand.palm[:, :3]) + hand.palm[:, 3:]).max(axis=0)
    upper[2] = (hand.palm[:, 2] + hand.palm[:, 5]).max()
    return np.stack([-upper, upper + margin_m])
