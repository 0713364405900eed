"""A setting that does not exist is an error wherever it is given."""

from dataclasses import dataclass, field

import pytest

from torc.brain.seeing import measured
from torc.errors import UnknownNameError
from torc.pipeline.building import build_pipeline, build_system, check_settings
from torc.pipeline.planners import make_spec_planner
from torc.registry.context import BuildContext
from torc.registry.settings import REQUIRED, arguments, settings_of
from torc.robots.loading import load_robot
from torc.specs.conditions import Conditions, PipelineSpec
from torc.specs.trial import PlannerSpec
from torc.workspace.workspace_files import load_workspace


def test_a_stage_that_does_not_exist_is_refused_when_conditions_are_written():
    for make in (Conditions, PipelineSpec):
        with pytest.raises(UnknownNameError, match=r"'oclusion\.smooth_px'\. Did you mean 'occlusion\.'"):
            make(settings={"oclusion.smooth_px": 3})
    with pytest.raises(UnknownNameError):
        PipelineSpec(settings={"motion.max_grasps": 3})  # a frame alone has no motions


@pytest.mark.parametrize(
    ("path", "nearest"),
    [
        ("motion.max_grasp", "motion.max_grasps"),
        ("simulation.risen", "simulation.risen_m"),
        ("failures.log_ods", "failures.log_odds"),
        ("grasps.candidates.max_blockd", "grasps.candidates.max_blocked"),
    ],
)
def test_a_misspelt_setting_of_a_stage_is_found_before_anything_runs(path, nearest):
    with pytest.raises(UnknownNameError, match=f"Did you mean '{nearest}'"):
        build_system(Conditions(settings={path: 1}))


def test_a_camera_that_takes_no_settings_gets_none():
    with pytest.raises(UnknownNameError, match=r"camera\.step"):
        build_system(Conditions(settings={"camera.step": 1}))


def test_so_is_one_for_a_frame():
    workspace, gripper = load_workspace(), load_robot().gripper
    with pytest.raises(UnknownNameError, match=r"bets\.cost'"):
        build_pipeline(PipelineSpec(settings={"bets.cost": 1}), gripper, workspace)
    with pytest.raises(UnknownNameError, match=r"bets\.cost'"):
        measured(None, PipelineSpec(settings={"bets.cost": 1}))


def test_so_is_one_of_a_planner():
    with pytest.raises(UnknownNameError, match=r"Did you mean 'planner\.relations\.closeness_m'"):
        make_spec_planner(PlannerSpec("dg-select", settings={"relations.closenes_m": 1}), None, None)
    with pytest.raises(UnknownNameError, match=r"planner\.k'"):
        make_spec_planner(PlannerSpec("random", settings={"k": 1}), None, None)


@dataclass(frozen=True)
class Inner:
    width_m: float = 0.1


@dataclass(frozen=True)
class Config:
    url: str
    inner: Inner = field(default_factory=Inner)


class Configured:
    def __init__(self, config: Config, camera=None):
        self.config = config


def test_settings_of_a_part_are_listed_with_their_defaults():
    assert settings_of(Configured) == [("url", REQUIRED), ("inner.width_m", 0.1)]
    assert settings_of(lambda step, camera, fast=True: None) == [("step", REQUIRED), ("fast", True)]


def test_what_a_part_is_given_is_no_setting():
    def make(camera, step=2):
        return camera, step

    arguments(make, {"step": 3}, "camera")
    with pytest.raises(UnknownNameError, match=r"Known: camera\.step\."):
        arguments(make, {"camera": 3}, "camera")
    assert BuildContext(camera=7, dof=6).given_to(make) == {"camera": 7}


def test_settings_that_are_right_are_left():
    check_settings(Conditions(settings={"simulation.risen_m": 0.03, "motion.max_grasps": 2}), noisy=False)
