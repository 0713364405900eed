"""The benchmark of missing depth: what its damages take, and what its table counts."""

import numpy as np
import pytest

from benchmarks import missing_depth


def test_damages_take_what_they_say(rng):
    depth_m = np.full((240, 320), 1.0, np.float32)
    depth_m[:, 160:] = 0.8
    for share in (0.01, 0.05):
        assert np.mean(missing_depth.speckles(share)(depth_m, rng)) == pytest.approx(share, rel=0.2)
        assert np.mean(missing_depth.blobs(share)(depth_m, rng)) == pytest.approx(share, rel=0.1)
    for px in (1, 2, 3):
        assert np.flatnonzero(missing_depth.edges(px)(depth_m, rng)[100]).tolist() == list(
            range(160 - px, 160 + px)
        )
