"""Which objects are drawn, and what they are called."""

import numpy as np
import pytest

from torc.errors import InputError
from torc.generation.sampling import placement_names, sample_models
from torc.objects.library import load_object


def test_samples_prefer_different_kinds_and_respect_held_out() -> None:
    rng = np.random.default_rng(2)
    names = sample_models(20, rng)
    assert len({load_object(n).kind for n in names}) == 20
    assert all(load_object(n).held_out for n in sample_models(6, rng, held_out=True))
    assert not any(load_object(n).held_out for n in sample_models(60, rng, held_out=False))
    assert len(set(sample_models(50, rng))) == 50
    with pytest.raises(InputError, match="0 to 64"):
        sample_models(65, rng)


def test_placement_names_are_unique() -> None:
    assert placement_names(["a", "b", "a", "a"]) == ["a", "b", "a_2", "a_3"]
