"""Retrievals without luck."""

import numpy as np
import pytest

from tools.ideal import Retrieval, after, looks_of, retrieve, shortest
from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.oracle.solve import MAX_PICKS, best_hold
from torc.pipeline.building import build_system
from torc.problems.problem import load_problem
from torc.records import TARGET_ID, Decision, GraspStatus
from torc.specs.conditions import Conditions
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.random_choice import RandomPlanner


@pytest.fixture(scope="module")
def look():
    system = build_system(Conditions())
    with open_sandbox(
        load_problem("validation-unstructured-01"), system, EpisodeConfig(MAX_PICKS, 0)
    ) as sandbox:
        yield looks_of(sandbox)


class Takes:
    """Takes these, then nothing."""

    name = "takes"

    def __init__(self, *order):
        self._left = list(order)

    def decide(self, context, rng):
        return Decision(self._left.pop(0) if self._left else None, "")


def test_what_is_taken_is_gone_and_nothing_else(look):
    first = look(())
    away = next(k for k in first.scene.ids if k != TARGET_ID)
    then = look((away,))
    assert away not in then.scene.ids
    assert [o.held_id for o in then.history] == [away]
    assert then.picks_left == MAX_PICKS - 1
    assert look([away]) is then


def test_a_retrieval_ends_with_the_target_or_without(look):
    away = next(k for k in look(()).scene.ids if k != TARGET_ID)
    found = retrieve(Takes(away, TARGET_ID, 99), look)
    assert found.order == (away, TARGET_ID)
    assert found.taken
    assert found.picks == 2
    lost = retrieve(Takes(away), look)
    assert not lost.taken
    assert lost.picks == MAX_PICKS
    assert retrieve(Takes(TARGET_ID), look, Retrieval((away,))).order == (away, TARGET_ID)


def test_tries_are_those_of_the_best_valid_grasp(look):
    context = look(())
    k = context.report.graspable_ids[0]
    valid = [
        s
        for s, of, status in zip(context.grasps.scores, context.grasps.object_ids, context.report.status)
        if of == k and status == GraspStatus.VALID
    ]
    assert best_hold(context, k) == max(valid)
    assert after(Retrieval(), context, k).tries == pytest.approx(1 / max(valid))
    assert best_hold(context, 63) == 0


@pytest.mark.long
def test_no_planner_needs_fewer_picks_than_the_shortest_order(look):
    least = shortest(look, 60)
    assert least is not None
    for planner in (DgSelectPlanner(), RandomPlanner()):
        assert retrieve(planner, look).picks >= least
    assert shortest(look, 0) is None


def test_the_same_retrieval_twice(look):
    assert retrieve(RandomPlanner(), look) == retrieve(RandomPlanner(), look)
    assert np.isfinite(retrieve(RandomPlanner(), look).tries)
