"""The example grasp planner keeps to the rules, and its grasps are where it says."""

import numpy as np
import pytest

from top_down_grasps import TopDown
from torc import load_robot
from torc.testing.grasp_conformance import CASES, check_case
from torc.testing.synthetic import SyntheticBox
from torc.testing.views import view_of


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_conforms(case):
    check_case(TopDown, case)


def test_it_closes_across_the_narrow_side():
    view = view_of(SyntheticBox(1, (0.62, -0.10, 1.08), (0.04, 0.12, 0.06)))
    planner = TopDown(load_robot().gripper, view.workspace.support_z_m)
    grasps = planner.plan(view.scene, view.volume, np.random.default_rng(0))
    assert len(grasps) == 2
    assert np.abs(grasps.Ts_world_tcp[:, 0, 0]).min() > 0.98
    assert grasps.widths_m == pytest.approx(0.04, abs=0.006)
    assert grasps.Ts_world_tcp[:, :2, 3] == pytest.approx(np.tile([0.62, -0.10], (2, 1)), abs=0.01)
