"""The learned picker: what it knows of a choice, and how it ranks."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.io.record_files import save_record
from torc.records import TARGET_ID
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.learned.features import FEATURE_NAMES, features_of
from torc.task_planning.learned.learned_planner import (
    MODEL_PATH,
    LearnedConfig,
    LearnedPlanner,
    PickerModel,
    load_picker,
)
from torc.testing.contexts import cluttered_context, empty_context


def column(features, name):
    return features[:, FEATURE_NAMES.index(name)]


@pytest.mark.parametrize("hidden", [True, False])
def test_each_choice_has_a_row(hidden, rng):
    context = cluttered_context(10, 3, hidden_target=hidden)
    ids, features = features_of(context, rng)
    assert ids == context.graspable_ids
    assert features.shape == (len(ids), len(FEATURE_NAMES))
    assert not np.isinf(features).any()
    dg = DgSelectPlanner().decide(context, rng)
    assert [ids[i] for i in np.flatnonzero(column(features, "chosen by the graph"))] == [dg.object_id]
    assert (column(features, "target in sight") == (not hidden)).all()
    shares = column(features, "share of hidden volume")
    assert (shares >= 0).all()
    assert shares.sum() <= 1 + 1e-6


def test_a_score_is_the_sum_of_its_parts(rng):
    n = len(FEATURE_NAMES)
    model = PickerModel(FEATURE_NAMES, rng.normal(size=n), rng.uniform(0.5, 2, n), rng.normal(size=n), 0.3)
    features = rng.normal(size=(5, n)).astype(np.float32)
    features[2, 4] = np.nan
    by_hand = []
    for row in features.astype(float):
        total = 0.3
        for x, mean, scale, weight in zip(row, model.mean, model.scale, model.weights):
            total += 0.0 if np.isnan(x) else weight * (x - mean) / scale
        by_hand.append(1 / (1 + np.exp(-total)))
    np.testing.assert_allclose(model.score(features), by_hand, rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_target_that_can_be_picked_is_picked(seed, rng):
    context = cluttered_context(8, seed)
    if TARGET_ID not in context.graspable_ids:
        pytest.skip("the target cannot be picked here")
    assert LearnedPlanner().decide(context, rng).object_id == TARGET_ID


def test_it_takes_the_most_probable_and_says_why(rng):
    context = cluttered_context(12, 5, hidden_target=True)
    decision = LearnedPlanner().decide(context, np.random.default_rng(1))
    p = decision.evidence.probabilities
    assert max(p, key=p.get) == decision.object_id
    assert set(p) == set(context.graspable_ids)
    assert any(name in decision.reason for name in FEATURE_NAMES)
    assert decision == LearnedPlanner().decide(context, np.random.default_rng(1))


def test_nothing_to_pick_is_no_choice(rng):
    assert LearnedPlanner().decide(empty_context(), rng).object_id is None


def test_models_that_cannot_be_used_are_refused(tmp_path):
    shipped = load_picker(MODEL_PATH)
    other = replace(shipped, feature_names=("something else", *FEATURE_NAMES[1:]))
    save_record(other, tmp_path / "other.npz")
    with pytest.raises(InputError, match="something else"):
        LearnedPlanner(LearnedConfig(str(tmp_path / "other.npz")))
    with pytest.raises(InputError):
        LearnedPlanner(LearnedConfig(str(tmp_path / "none.npz")))
    with pytest.raises(InputError, match="each feature"):
        replace(shipped, feature_names=FEATURE_NAMES[:-1])
    with pytest.raises(InputError, match="finite"):
        replace(shipped, weights=shipped.weights * np.nan)
    with pytest.raises(InputError, match="positive"):
        replace(shipped, scale=shipped.scale * 0)
