"""What is looked at once it is lifted."""

from types import SimpleNamespace

import numpy as np

from torc.episode import held
from torc.episode.held import HeldLook
from torc.perception.protocol import Wanted
from torc.records import Observation


def test_where_the_object_was_no_depth_counts_as_that_of_before(monkeypatch):
    """A box that is lifted along its front shows the same depth there."""
    depth = np.full((8, 8), 0.5, np.float32)
    observation = Observation(np.zeros((8, 8, 3), np.uint8), depth, np.eye(3), np.eye(4), np.zeros(7), 0.0)
    own = np.array([[2, 3], [4, 5]])
    scene = SimpleNamespace(observation=observation, object=lambda k: {3: SimpleNamespace(pixels=own)}[k])
    pipeline = SimpleNamespace(
        measured=lambda seen, rng: seen,
        depth=SimpleNamespace(),
        noise=None,
        perception=SimpleNamespace(recognise=lambda *args: 0.9),
    )
    given = []
    monkeypatch.setattr(held, "held_mask", lambda seen, before, *rest: given.append(before) or depth > 0)
    look = HeldLook(
        pipeline,
        None,
        SimpleNamespace(context=SimpleNamespace(scene=scene)),
        Wanted(""),
        3,
        np.random.default_rng(),
    )
    assert look(observation, 0.04)
    changed = np.argwhere(given[0] != depth)
    np.testing.assert_array_equal(changed, own)
    assert (given[0][tuple(own.T)] == 0).all()
    assert (depth == 0.5).all()
