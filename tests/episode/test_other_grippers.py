"""Trials with grippers of other openings than the shipped one's."""

import pytest

from tools.grippers import write_slides
from torc.episode.trial import run_trial
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem, save_problem
from torc.specs.trial import TrialSpec
from torc.workspace.files import load_workspace

TABLE_Z = load_workspace().support_z_m


def _standing(name, x, y):
    height = load_object(name).size_m[2]
    return ObjectPlacement(name, name, (x, y, TABLE_Z + height / 2 + 0.001), (1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("max_width_m", [0.078, pytest.param(0.14, marks=pytest.mark.slow)])
def test_a_trial_with_another_gripper_retrieves_the_target(max_width_m, tmp_path):
    robot = write_slides(tmp_path, max_width_m)
    placements = (_standing("soup_can_red", 0.62, -0.12), _standing("milk_carton_small", 0.66, 0.06))
    problem = Problem("own", "structured", "the soup can", "soup_can_red", placements)
    save_problem(problem, tmp_path / "own.yaml")
    spec = TrialSpec.of(str(tmp_path / "own.yaml"), "random", robot=str(robot), max_picks=3)
    result = run_trial(spec, tmp_path / "trial", say=lambda text: None).result
    assert result["status"] == "completed", result
    assert result["retrieved"]
