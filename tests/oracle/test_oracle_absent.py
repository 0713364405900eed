"""Where the target is not there, ORACLE gives up as soon as it can be nowhere, and the trial counts as solved."""

import pytest

from torc.benchmark.reading import read_table
from torc.oracle.solve import solve_problem
from torc.pipeline.building import build_system
from torc.problems.problem import ObjectPlacement, Problem, save_problem
from torc.specs.conditions import Conditions
from torc.specs.trial import TrialSpec
from torc.trials.trial import run_trial

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
MILK = ObjectPlacement("milk", "milk_carton_blue", (0.60, -0.09, 1.165), UPRIGHT)
DIE = ObjectPlacement("die", "die_red", (0.66, -0.30, 1.06), UPRIGHT)
NO_CAN = Problem("no_can", "structured", "the red soup can", "can", (DIE, MILK), target_model="soup_can_red")
"""The can could stand behind the carton alone: the die is too small to hide it."""


@pytest.mark.long
def test_it_takes_away_what_might_hide_the_target_and_gives_up(tmp_path):
    answer = solve_problem(NO_CAN, build_system(Conditions()), budget=12)
    assert answer.solved
    assert answer.proved
    assert answer.order == ("milk",)
    assert answer.lower_bound == 1
    save_problem(NO_CAN, tmp_path / "no_can.yaml")
    spec = TrialSpec.of(str(tmp_path / "no_can.yaml"), "oracle", 0)
    result = run_trial(spec, tmp_path / "trials" / "oracle").result
    assert (result.end, result.picks, result.target_absent) == ("gave up", 1, True)
    assert not result.retrieved
    (row,) = read_table(tmp_path / "trials").rows
    assert row.absent
    assert row.solved
    assert row.cost == 1


@pytest.mark.long
def test_informed_gives_up_then_too(tmp_path):
    save_problem(NO_CAN, tmp_path / "no_can.yaml")
    spec = TrialSpec.of(str(tmp_path / "no_can.yaml"), "informed", 0)
    result = run_trial(spec, tmp_path / "trial").result
    assert (result.end, result.picks) == ("gave up", 1)


@pytest.mark.long
def test_who_never_gives_up_is_charged_until_the_table_is_clear(tmp_path):
    save_problem(NO_CAN, tmp_path / "no_can.yaml")
    spec = TrialSpec.of(str(tmp_path / "no_can.yaml"), "dg-select", 0)
    run_trial(spec, tmp_path / "trials" / "dg")
    (row,) = read_table(tmp_path / "trials").rows
    assert row.end == "nothing left to try"
    assert row.solved
    assert row.picks >= 2
