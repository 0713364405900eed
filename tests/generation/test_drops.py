"""What is dropped hangs free of everything else, in any orientation."""

import numpy as np
import pytest

from torc.generation.arrangements import (
    DROP_CENTER,
    DROP_FROM_Z_M,
    DROP_GAP_M,
    DROP_SIZE,
    bounding_radius,
    drop_arrangement,
)
from torc.generation.sampling import sample_models
from torc.objects.library import load_object


@pytest.mark.parametrize("seed", range(6))
def test_dropped_objects_are_apart_and_between_the_walls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    placements = drop_arrangement(sample_models(15, rng), rng)
    centers = np.array([p.position for p in placements])
    radii = np.array([bounding_radius(load_object(p.model)) for p in placements])
    apart = np.linalg.norm(centers[:, None] - centers[None], axis=2) - radii[:, None] - radii[None]
    assert apart[~np.eye(len(radii), dtype=bool)].min() >= DROP_GAP_M - 1e-9
    assert (centers[:, 2] - radii).min() >= DROP_FROM_Z_M - 1e-9
    inside = (
        np.abs(centers[:, :2] - DROP_CENTER) <= np.maximum(np.array(DROP_SIZE) / 2 - radii[:, None], 0) + 1e-9
    )
    assert inside.all()
    assert centers[:, 2].max() < DROP_FROM_Z_M + 1.0  # a fall from higher would scatter the heap
