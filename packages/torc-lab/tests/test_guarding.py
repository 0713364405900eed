"""Where nobody would feel a contact, torc is slower and keeps further away, and says so."""

from dataclasses import replace

import pytest

from torc.episode.events import Started
from torc.pipeline.building import build_system
from torc.robots.execution import ExecutionConfig
from torc.specs.conditions import Conditions
from torc.trials.log import line_of
from torc_lab.planning import WITHOUT_GUARD, guarded

FEELS, NUMB = ExecutionConfig(), ExecutionConfig(free_guard=None, approach_guard=None)


@pytest.fixture
def system_of():
    return lambda **changed: build_system(Conditions(**changed))


def test_with_a_guard_all_is_as_in_simulation(system_of):
    system = system_of()
    found, text = guarded(system, FEELS)
    assert found is system
    assert "stops at a contact of 40 N" in text


def test_without_one_approaches_are_slower_and_grasps_keep_further_away(system_of):
    system = system_of()
    found, text = guarded(system, NUMB)
    motion, before = found.motion_planner.config.cartesian, system.motion_planner.config.cartesian
    assert motion.approach_speed_m_s == 0.05 < before.approach_speed_m_s
    checks = found.pipeline.grasp_planner.config.checks
    ordinary = system.pipeline.grasp_planner.config.checks
    for name in ("finger_margin_m", "palm_margin_m", "table_margin_m", "tip_margin_m"):
        assert getattr(checks, name) == WITHOUT_GUARD[f"grasps.checks.{name}"] > getattr(ordinary, name)
    # What the planner of motions is told, the pipeline knows, too.
    assert found.pipeline.motion == found.motion_planner.config
    assert "0.05 m/s" in text
    assert f"keep {WITHOUT_GUARD['grasps.checks.finger_margin_m']:g} m from other objects" in text


def test_what_the_lab_file_says_itself_counts_and_is_told(system_of):
    own = {"motion.cartesian.approach_speed_m_s": 0.02, "grasps.checks.finger_margin_m": 0.001}
    found, text = guarded(system_of(settings=own), NUMB)
    assert found.motion_planner.config.cartesian.approach_speed_m_s == 0.02
    checks = found.pipeline.grasp_planner.config.checks
    assert checks.finger_margin_m == 0.001
    assert checks.palm_margin_m == WITHOUT_GUARD["grasps.checks.palm_margin_m"]
    assert "0.02 m/s" in text
    assert "keep 0.001 m" in text


def test_planners_without_these_settings_get_none_and_that_is_told(system_of, tmp_path):
    own = tmp_path / "own.py"
    own.write_text(
        "class Own:\n"
        "    def __init__(self, gripper, support_z_m): pass\n"
        "    def plan(self, scene, volume, rng): return None\n",
        encoding="utf-8",
    )
    found, text = guarded(system_of(grasps=f"{own}:Own"), NUMB)
    assert found.motion_planner.config.cartesian.approach_speed_m_s == 0.05
    assert "How careful grasps are is their planner's own matter" in text


def test_it_stands_in_the_log_of_a_real_trial_and_only_there():
    begun = Started("lab-x", "dg-select", 0, "a mug", 5)
    assert "guard" not in line_of(begun).plain
    assert line_of(replace(begun, guard="The robot feels no contact.")).plain["guard"].startswith("The robot")
