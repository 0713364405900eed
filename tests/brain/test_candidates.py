"""What becomes of grasps, and those of the choice."""

import numpy as np
import pytest

from tests.helpers.fake_episode import ScriptedPlanner
from torc.brain import decide_frame
from torc.brain.candidates import STATUS_WORDS, blockers_of, status_counts
from torc.records import GraspStatus
from torc.testing.contexts import box, make_context


def context():
    shapes = (box(0, 0.72, -0.1, (0.06, 0.06, 0.2)), box(1, 0.6, -0.1, (0.06, 0.08, 0.12)))
    return make_context(shapes, valid={1: 2}, blocked={0: [(1,), (1,)]}, unreachable={0: 3})


def test_every_status_is_counted_and_has_words():
    assert set(STATUS_WORDS) == set(GraspStatus)
    assert status_counts(context(), 0) == {GraspStatus.BLOCKED: 2, GraspStatus.UNREACHABLE: 3}
    assert status_counts(context(), 1) == {GraspStatus.VALID: 2}
    assert blockers_of(context(), 0) == {1: 2}
    assert blockers_of(context(), 1) == {}


@pytest.mark.parametrize("chosen", [0, 1, 7])
def test_the_grasps_of_the_choice_are_its_valid_ones_best_first(frame_of, chosen):
    answer = decide_frame(frame_of(), ScriptedPlanner([chosen]))
    p = [grasp.p for grasp in answer.grasps]
    assert p == sorted(p, reverse=True)
    assert len(p) == answer.look.context.report.valid_total[answer.look.context.scene.ids.index(chosen)]
    points = answer.look.context.scene.object(chosen).points
    for grasp in answer.grasps:
        distance = np.linalg.norm(points - grasp.T_world_tcp[:3, 3], axis=1).min()
        assert distance < 0.06  # at the object, and nowhere else
    assert answer.to_dict()["grasps"] == [grasp.to_dict() for grasp in answer.grasps]
