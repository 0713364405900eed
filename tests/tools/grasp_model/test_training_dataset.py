"""Shards: what is written comes back, what is half-written does not exist."""

import numpy as np
import pytest
from training_trials import make_trials

from tools.grasp_model.dataset import (
    column_names,
    concatenate,
    load_shard,
    save_shard,
)
from torc.errors import InputError


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
