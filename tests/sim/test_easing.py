"""Objects that start inside each other come apart and nothing flies."""

import numpy as np
from sim_scenes import TABLE_Z, UPRIGHT, problem

from torc.problems.problem import ObjectPlacement
from torc.sim.settling import EASED_M, ease_apart, settle
from torc.sim.world import build_world
from torc.workspace.files import load_workspace


def _overlapping(depth_m: float):
    """Two cans side by side, one pushed into the other, and one sunk into the table."""
    radius = 0.033
    z = TABLE_Z + 0.0515
    cans = (
        ObjectPlacement("a", "soup_can_red", (0.60, -0.10, z), UPRIGHT),
        ObjectPlacement("b", "soup_can_red", (0.60, -0.10 + 2 * radius - depth_m, z), UPRIGHT),
        ObjectPlacement("c", "soup_can_red", (0.75, -0.10, z - depth_m), UPRIGHT),
    )
    return build_world(problem(*cans), None, load_workspace())


def test_overlapping_cans_come_apart_and_keep_standing():
    world = _overlapping(0.02)
    before = world.positions
    before_m, after_m = ease_apart(world)
    assert before_m > 0.015
    assert after_m <= EASED_M
    assert np.abs(world.velocities).max() == 0.0
    moved = np.linalg.norm(world.positions - before, axis=1)
    assert moved.max() < 0.03
    assert settle(world).settled
    upright = 1 - 2 * (world.wxyz[:, 1] ** 2 + world.wxyz[:, 2] ** 2)
    assert upright.min() > 0.99
