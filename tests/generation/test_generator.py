"""A problem is a function of its configuration and its seed, and is what was asked for."""

from collections import Counter
from dataclasses import replace

import pytest

from tools.grippers import write_slides
from torc.errors import InputError
from torc.generation import generator as generator_module
from torc.generation.clutter import ClutterConfig
from torc.generation.config import (
    GENERATOR_VERSION,
    GenerationConfig,
    Reason,
    RejectedError,
)
from torc.generation.generator import GeneratedProblem, Job, generate_batch, generate_problem, is_made_from
from torc.objects.library import load_object
from torc.problems.problem import parse_problem, problem_text
from torc.robots.loading import load_robot
from torc.specs.conditions import Conditions

SMALL = GenerationConfig("structured", objects=(8, 8))


@pytest.fixture(scope="module")
def generated(inspector):
    """Eight standing objects, from seed 3."""
    return generate_problem(SMALL, 3, inspector)


@pytest.mark.long
def test_the_same_seed_gives_the_same_problem_bit_for_bit(generated, inspector):
    again = generate_problem(SMALL, 3, inspector)
    assert isinstance(generated, GeneratedProblem)
    assert again == generated
    assert problem_text(again.problem) == problem_text(generated.problem)


def test_it_is_what_was_asked_for(generated, inspector):
    problem = generated.problem
    assert problem.category == "structured"
    assert len(problem.objects) == 8 == generated.difficulty.objects
    target = next(o for o in problem.objects if o.name == problem.target)
    assert problem.description == load_object(target.model).description
    assert Counter(o.model for o in problem.objects)[target.model] == 1
    view = inspector.view(problem)
    assert not inspector.graspable_at_first(view, problem.target, generator_module.FIRST_LOOKS)
    around = inspector.around(problem, problem.target)
    assert all(inspector.graspable_at_all(problem, name) for name in (problem.target, *around.all))
    assert generated.difficulty.visible_fraction == pytest.approx(view.fraction(problem.target))
    assert problem.origin["generator"] == GENERATOR_VERSION
    assert problem.origin["visible_fraction"] == round(generated.difficulty.visible_fraction, 4)


class _Rejecting:
    """Stands in for an attempt: rejects the first ones."""

    def __init__(self, rejected, made):
        self.rejected, self.made, self.seen = list(rejected), made, []

    def __call__(self, config, count, models, seed, attempt, inspector):
        self.seen.append((count, seed, attempt))
        if self.rejected:
            raise RejectedError(self.rejected.pop(0))
        return self.made


def test_attempts_go_on_from_the_same_seed_and_are_counted(generated, inspector, monkeypatch):
    rejected = [Reason.TRIVIAL, Reason.PHYSICS, Reason.TRIVIAL]
    attempts = _Rejecting(rejected, (generated.problem, generated.difficulty))
    monkeypatch.setattr(generator_module, "_attempt", attempts)
    told = []
    made = generate_problem(
        SMALL, 7, inspector, progress=lambda attempt, reason: told.append((attempt, reason))
    )
    assert isinstance(made, GeneratedProblem)
    assert made.attempts == 4
    assert made.rejections == {Reason.TRIVIAL: 2, Reason.PHYSICS: 1}
    assert told == list(enumerate(rejected, start=1))
    assert attempts.seen == [(8, 7, a) for a in range(4)]
    assert made.problem.origin["attempt"] == 3


def test_a_problem_tells_what_it_was_made_from(generated, inspector):
    problem, robot = generated.problem, inspector.robot
    assert is_made_from(problem, SMALL, 3, robot)
    assert is_made_from(parse_problem(problem_text(problem)), SMALL, 3, robot)
    assert not is_made_from(problem, SMALL, 4, robot)
    assert not is_made_from(problem, replace(SMALL, hidden="partly"), 3, robot)
    assert not is_made_from(problem, SMALL, 3, replace(robot, source="a1"))
    older = replace(problem, origin={**problem.origin, "generator": GENERATOR_VERSION - 1})
    assert not is_made_from(older, SMALL, 3, robot)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"objects": (1, 5)}, "2 to 64"),
        ({"objects": (9, 8)}, "9-8"),
        ({"hidden": "maybe"}, "Unknown hiddenness 'maybe'.*partly"),
        ({"attempts": 0}, "at least one attempt"),
    ],
)
def test_wrong_configurations_are_refused(wrong, told):
    with pytest.raises(InputError, match=told):
        GenerationConfig(**wrong)


@pytest.mark.slow
@pytest.mark.parametrize("category", ["structured", "unstructured"])
def test_other_processes_make_the_same_problems_in_the_same_order(category, inspector):
    jobs = [Job(GenerationConfig(category, (8, 9)), seed) for seed in (11, 12, 13)]
    made = dict(generate_batch(jobs, Conditions(), workers=2))
    assert list(made) == jobs
    assert [made[job] for job in jobs] == [generate_problem(job.config, job.seed, inspector) for job in jobs]


def test_no_generated_box_lies_so_that_it_is_too_wide_for_the_gripper(tmp_path):
    given = ClutterConfig()
    assert generator_module._for_gripper(given, load_robot().gripper) == given
    narrow = load_robot(str(write_slides(tmp_path, 0.05))).gripper
    assert generator_module._for_gripper(given, narrow).arrangement.lying_width_m < 0.05
