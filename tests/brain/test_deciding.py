"""Decisions for frames from anywhere."""

import numpy as np
import pytest

from tests.helpers.fake_episode import ScriptedPlanner
from torc.brain import decide_frame
from torc.errors import InputError


def test_the_answer_is_in_the_frames_own_labels(frame_of):
    for object_id, label in ((0, 512), (1, 40_000), (7, 7)):
        assert decide_frame(frame_of(), ScriptedPlanner([object_id])).label == label
    assert decide_frame(frame_of(), ScriptedPlanner([None])).label is None


def test_the_same_frame_and_seed_give_the_same_answer(frame_of):
    answers = [decide_frame(frame_of(), seed=4).to_dict() for _ in range(2)]
    for answer in answers:
        del answer["seconds"]
    assert answers[0] == answers[1]


def test_distance_does_not_matter(frame_of):
    """What the camera has seen free is free, however far away it is."""
    near, far = (decide_frame(frame_of(distance_m=d)) for d in (1.0, 6.0))
    assert near.label == far.label
    shares = [1 - a.look.context.volume.seen.mean() for a in (near, far)]
    assert shares[1] == pytest.approx(shares[0], abs=0.05)
    assert min(far.look.context.report.valid_total) > 0


@pytest.mark.parametrize("support_z_m", [1.05, 0.80])
def test_a_robot_works_at_the_table_that_is_seen(frame_of, support_z_m):
    answer = decide_frame(frame_of(support_z_m=support_z_m), robot="sda10f_2f85")
    world = answer.look.world
    table = world.boxes[world.box_names.index("table")]
    assert table[5] == pytest.approx(support_z_m, abs=0.02)
    bin_floor = world.boxes[world.box_names.index("bin_floor")]
    # The rest of the robot's own workspace stands there too.
    assert (bin_floor[5] > 0) == (support_z_m == 1.05)


def test_a_choice_that_is_not_in_sight_is_refused(frame_of):
    with pytest.raises(InputError, match="object 23, which is not in sight"):
        decide_frame(frame_of(), ScriptedPlanner([23]))


def test_the_volume_of_one_frame_goes_into_the_next(frame_of):
    first = decide_frame(frame_of())
    second = decide_frame(frame_of(), volume=first.look.context.volume)
    assert second.look.context.volume.snapshots == 2
    assert np.array_equal(first.look.context.volume.seen, second.look.context.volume.seen)
