"""The space that objects hide, counted in one pass."""

from dataclasses import replace

import numpy as np

from torc.occlusion.hidden_space import hidden_volumes_m3
from torc.testing import contexts


def test_hidden_volumes_are_the_records_own(rng: np.random.Generator) -> None:
    volume = contexts.hidden_context().volume
    masks = rng.integers(0, 2**64, volume.hidden_by.shape, dtype=np.uint64) & rng.integers(
        0, 2**64, volume.hidden_by.shape, dtype=np.uint64
    )
    volume = replace(volume, hidden_by=masks)
    expected = [volume.hidden_volume_m3(k) for k in range(64)]
    np.testing.assert_allclose(hidden_volumes_m3(volume, range(64)), expected, rtol=1e-12)
