"""A trial is played only as it was planned."""

import shutil
import sys
from dataclasses import replace

import pytest

from tests.helpers.fake_bench import fake_spec
from torc.benchmark.playing import Order, changed_part, play
from torc.benchmark.spec import Around, BenchPlanner, BenchProblem, problem_fingerprint
from torc.errors import InputError
from torc.io.digests import file_fingerprint, forget_files
from torc.objects.object_files import save_object
from torc.problems.problem import load_problem, save_problem
from torc.robots.loading import own_source
from torc.robots.schema import EXAMPLE
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec

PARTS = """
class Decides:
    def decide(self, context, rng): ...

class Grasps:
    def plan(self, scene, volume, rng): ...
"""


@pytest.fixture
def planned(tmp_path, monkeypatch):
    """A trial with a planner, a grasp planner and a robot of the user's, and the files of parts and robot."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "parts_that_change", raising=False)
    parts, robot = tmp_path / "parts_that_change.py", tmp_path / "robot" / EXAMPLE.name
    parts.write_text(PARTS)
    shutil.copytree(EXAMPLE.parent, robot.parent)
    shutil.copytree(EXAMPLE.parent.parent / "shared", tmp_path / "shared")
    source = file_fingerprint(parts)
    around = Around(
        Conditions(robot=str(robot), grasps="parts_that_change:Grasps"),
        {"robot": own_source(str(robot)), "grasps": source},
    )
    planner = BenchPlanner(PlannerSpec("parts_that_change:Decides"), source=source)
    forget_files()
    return replace(fake_spec().trials[0], planner=planner, around=around), parts, robot


def test_a_file_that_was_changed_before_it_was_imported_is_named(planned, tmp_path):
    trial, parts, _ = planned
    parts.write_text(PARTS + "# changed")
    assert changed_part(trial) == "planner 'parts_that_change:Decides'"
    shipped = replace(trial, planner=BenchPlanner(PlannerSpec("random")))
    assert changed_part(shipped) == "grasps 'parts_that_change:Grasps'"
    with pytest.raises(InputError, match="grasps 'parts_that_change:Grasps' has changed since"):
        play(Order(shipped, "structured-04", tmp_path / "work"))
    assert not (tmp_path / "work").exists()


def test_a_problem_whose_own_objects_were_changed_is_not_played(own_problem, tmp_path):
    problem, mine = own_problem
    save_problem(problem, tmp_path / "with-mine.yaml")
    planned = BenchProblem("with-mine", "structured", problem_fingerprint(problem), shipped=False)
    trial = replace(fake_spec().trials[0], problem=planned, planner=BenchPlanner(PlannerSpec("random")))
    assert problem_fingerprint(load_problem(str(tmp_path / "with-mine.yaml"))) == planned.digest
    save_object(replace(mine, mass_kg=2.0), tmp_path / "objects" / "my_mug", overwrite=True)
    with pytest.raises(InputError, match=r"'with-mine', or an object of your own .* has changed since"):
        play(Order(trial, str(tmp_path / "with-mine.yaml"), tmp_path / "work"))
    assert not (tmp_path / "work").exists()
