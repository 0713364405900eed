"""What the arrays say is what the context says."""

import numpy as np
import pytest

from torc.gym_env.env import PER_OBJECT, observed, stacked
from torc.occlusion.volume import hidden_volumes_m3
from torc.records import MAX_OBJECTS, PickOutcome, PickResult
from torc.task_planning.graph_building import build_dependency_graph
from torc.testing.contexts import box, make_context


@pytest.fixture
def context():
    """Box 1 before the target 0, box 2 beside them."""
    shapes = [
        box(0, 0.70, -0.1, (0.05, 0.05, 0.05)),
        box(1, 0.60, -0.1, (0.05, 0.05, 0.08)),
        box(2, 0.65, 0.1, (0.06, 0.06, 0.1)),
    ]
    history = (PickOutcome(PickResult.MISSED, 2), PickOutcome(PickResult.NO_VALID_CHOICE, -1))
    return make_context(
        shapes, valid={1: 2}, blocked={0: [(1,), (1,)], 2: [(1,)]}, history=history, picks_left=3
    )


def test_flags_shares_and_edges_are_those_of_the_context(context):
    seen = observed(context, max_picks=5)
    ids = list(context.scene.ids)
    assert np.flatnonzero(seen["visible"]).tolist() == ids
    assert np.flatnonzero(seen["graspable"]).tolist() == [1] == np.flatnonzero(seen["best_score"]).tolist()
    assert np.flatnonzero(seen["target"]).tolist() == [0]
    assert seen["blocked"][ids].tolist() == [1.0, 0.0, 1.0]
    assert seen["tried"].nonzero()[0].tolist() == [2]
    assert seen["tried"][2] == pytest.approx(1 / 5)
    assert seen["picks_left"] == pytest.approx(3 / 5)
    unseen = np.count_nonzero(~context.volume.seen) * context.volume.grid.voxel_size_m**3
    assert seen["hidden_volume"][ids] * unseen == pytest.approx(hidden_volumes_m3(context.volume, ids))
    weights = build_dependency_graph(context).weight_matrix()
    assert seen["edges"][np.ix_(ids, ids)] == pytest.approx(weights)
    assert seen["edges"].sum() == pytest.approx(weights.sum())


def test_stacked_has_a_row_per_object_and_the_targets_edges_last(context):
    seen = observed(context, 5)
    rows = stacked(seen)
    assert rows.shape == (MAX_OBJECTS, len(PER_OBJECT) + 3)
    assert np.array_equal(rows[:, -1], seen["edges"][0])
    assert np.array_equal(rows[:, 0], seen["visible"])
