"""What is looked at once it is lifted."""

from types import SimpleNamespace

import numpy as np
import pytest

from torc.episode import held
from torc.episode.held import HeldLook, told_by
from torc.perception.protocol import Wanted
from torc.records import Observation

DEPTH = np.full((8, 8), 0.5, np.float32)
OWN = np.array([[2, 3], [4, 5]])


def look_of(monkeypatch, p, masks):
    """A look at object 3, whose sides are seen with these probabilities and masks, and the snapshot; and what
    `held_mask` was given as the depth of before."""
    observation = Observation(np.zeros((8, 8, 3), np.uint8), DEPTH, np.eye(3), np.eye(4), np.zeros(7), 0.0)
    scene = SimpleNamespace(observation=observation, object=lambda k: {3: SimpleNamespace(pixels=OWN)}[k])
    p, masks, given = iter(p), iter(masks), []
    pipeline = SimpleNamespace(
        measured=lambda seen, rng: seen,
        depth=SimpleNamespace(),
        noise=None,
        perception=SimpleNamespace(recognise=lambda *args: next(p)),
    )
    monkeypatch.setattr(held, "held_mask", lambda seen, before, *rest: given.append(before) or next(masks))
    context = SimpleNamespace(context=SimpleNamespace(scene=scene))
    look = HeldLook(pipeline, None, context, Wanted(""), 3, np.random.default_rng())
    return look, observation, given


def test_where_the_object_was_no_depth_counts_as_that_of_before(monkeypatch):
    """A box that is lifted along its front shows the same depth there."""
    look, observation, given = look_of(monkeypatch, [0.9], [DEPTH > 0])
    assert look(observation, 0.04, True)
    changed = np.argwhere(given[0] != DEPTH)
    np.testing.assert_array_equal(changed, OWN)
    assert (given[0][tuple(OWN.T)] == 0).all()
    assert (DEPTH == 0.5).all()


@pytest.mark.parametrize(
    ("p", "seen", "told"),
    [
        ([0.5, 0.95, 0.5], [True, False, True], False),  # not seen is as before the pick, and no side of it
        ([0.95, 0.3, 0.2], [False, True, True], False),  # what is seen replaces what was believed
        ([0.95, 0.85, 0.95], [False, True, False], True),  # one side alone was seen
        ([0.95, 0.95, 0.95], [False, False, False], True),
    ],
)
def test_a_side_that_cannot_be_seen_does_not_count(monkeypatch, p, seen, told):
    look, observation, _ = look_of(monkeypatch, p, [(DEPTH > 0) & s for s in seen])
    assert [look(observation, 0.04, k == 2) for k in range(3)] == [None, None, told]
    assert look.is_target is told


@pytest.mark.parametrize(
    ("sides", "told"),
    [
        ([0.98], True),
        ([0.05], False),
        ([0.5], None),
        ([0.9], None),
        ([0.5, 0.05], None),
        ([0.5, 0.94], True),
        ([0.98, 0.5], True),
        ([0.94, 0.2, 0.3], True),
    ],
)
def test_other_sides_are_asked_for_where_one_leaves_doubt(sides, told):
    assert told_by(sides, last=False) is told


@pytest.mark.parametrize(
    ("sides", "told"), [([0.79], False), ([0.81], True), ([0.81, 0.5], False), ([0.5, 0.93, 0.1], True)]
)
def test_the_last_side_decides(sides, told):
    assert told_by(sides, last=True) is told
