"""Collecting: an interrupted collection ends like an uninterrupted one, and what is written comes back."""

import numpy as np
import pytest
from training_trials import make_trials

from tools.grasp_model.collect import CollectConfig, collect
from tools.grasp_model.dataset import (
    column_names,
    concatenate,
    load_shard,
    save_shard,
    shard_ranges,
)
from tools.grasp_model.refresh import refresh
from tools.grasp_model.sampling import SamplingConfig
from tools.grasp_model.scenes import SceneConfig
from torc.errors import InputError

SMALL = CollectConfig(
    scenes=SceneConfig(min_objects=3, max_objects=4, structured_share=1.0),
    sampling=SamplingConfig(first_trials=9, later_trials=4),
    stages=2,
    taken_away=1,
    shard_trials=1,
)


def table(directory):
    return concatenate([load_shard(path) for _, _, path in shard_ranges(directory)])


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    out = tmp_path_factory.mktemp("whole")
    collect(out, 2, 7, SMALL)
    return out


def test_interrupted_collection_ends_like_a_whole_one(collected, tmp_path):
    collect(tmp_path, 1, 7, SMALL)
    assert [(a, b) for a, b, _ in shard_ranges(tmp_path)] == [(0, 0)]
    collect(tmp_path, 2, 7, SMALL)
    whole, resumed = table(collected), table(tmp_path)
    for name in column_names():
        assert np.array_equal(getattr(whole, name), getattr(resumed, name)), name


def test_refreshed_trials_are_the_same_while_features_are(collected, tmp_path):
    refresh(collected, tmp_path)
    old, new = table(collected), table(tmp_path)
    assert len(new) == len(old)
    match = {T.tobytes(): i for i, T in enumerate(old.T_world_tcp)}
    index = np.array([match[T.tobytes()] for T in new.T_world_tcp])
    assert np.array_equal(old.delivered[index], new.delivered)
    assert np.allclose(old.features[index], new.features, rtol=1e-4, atol=1e-5)
    assert np.array_equal(old.valid[index], new.valid)


def test_shard_round_trip(tmp_path):
    trials = make_trials(50, seed=1)
    back = load_shard(save_shard(tmp_path, trials, 0, 19))
    assert back.feature_names == trials.feature_names
    for name in column_names():
        a, b = getattr(trials, name), getattr(back, name)
        assert np.array_equal(a, b), name
        assert a.dtype == b.dtype or a.dtype.kind == "U", name


def test_mixed_features_are_refused():
    a, b = make_trials(5, seed=1), make_trials(5, seed=2)
    object.__setattr__(b, "feature_names", ("extent", "contacts", "noise_a", "noise_b", "other"))
    with pytest.raises(InputError, match="other"):
        concatenate([a, b])
