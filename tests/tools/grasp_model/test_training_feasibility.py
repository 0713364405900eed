"""What the gripper gets hold of: told apart by trying, always the same, and never measured twice."""

import pytest

from tools.grasp_model.facts import model_digest
from tools.grasp_model.feasibility import FeasibilityConfig, measure
from torc.grasping.planner import GeometricGraspPlanner
from torc.objects.grasp_facts import GraspFact, all_grasp_facts
from torc.objects.library import load_object
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.workspace.description import Workspace
from torc.workspace.files import load_workspace

Bench = tuple[RobotDescription, GeometricGraspPlanner, Workspace]
QUICK = FeasibilityConfig(turns=1, falls=1, tries=4)


@pytest.fixture(scope="module")
def bench() -> Bench:
    robot, workspace = load_robot(), load_workspace()
    return robot, GeometricGraspPlanner(robot.gripper, workspace.support_z_m), workspace


def test_a_die_is_held_and_a_flat_plate_is_not(bench: Bench) -> None:
    die = measure("die_white", *bench, QUICK)
    assert die == GraspFact(1.0, 1.0, model_digest(load_object("die_white")))
    assert measure("plate_white", *bench, QUICK).standing == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["teacup_blue", "book_blue", "toy_plane_red"])
def test_the_shipped_facts_are_what_is_measured(name: str, bench: Bench) -> None:
    assert measure(name, *bench) == all_grasp_facts()[name]
