"""A held object's spheres cover its hull and do not swell much beyond it."""

import numpy as np
import pytest

from torc.motion.holding import hull_spheres


@pytest.mark.parametrize(
    "size", [(0.05, 0.05, 0.05), (0.03, 0.06, 0.18), (0.09, 0.09, 0.01), (0.012, 0.012, 0.2)]
)
def test_spheres_cover_the_hulls_surface(size):
    rng = np.random.default_rng(0)
    half = np.array(size) / 2
    face = rng.integers(3, size=3000)
    points = rng.uniform(-half, half, (3000, 3))
    sides = np.where(rng.random(3000) < 0.5, -1.0, 1.0)
    points[np.arange(3000), face] = sides * half[face]
    center = np.array([0.01, -0.02, 0.2])
    spheres = hull_spheres(points + center, 40)
    assert 1 <= len(spheres) <= 60
    gap = np.linalg.norm(points[:, None] + center - spheres[:, :3], axis=2) - spheres[:, 3]
    uncovered = gap.min(axis=1)
    # A third of the points went into the spheres; the others lie between those.
    assert uncovered.max() < 0.003
    assert np.mean(uncovered > 0) < 0.01
    beyond = np.abs(spheres[:, :3] - center) + spheres[:, 3:] - half
    assert beyond.max() < 1.3 * spheres[0, 3] + 0.002


def test_flat_clouds_few_points_and_none_have_spheres_too():
    rng = np.random.default_rng(1)
    flat = rng.uniform(-0.05, 0.05, (200, 3))
    flat[:, 2] = 0.1
    assert 1 <= len(hull_spheres(flat, 30)) <= 30
    assert len(hull_spheres(flat[:1], 30)) == 1
    assert hull_spheres(np.zeros((0, 3)), 30).shape == (0, 4)
    for n in range(2, 12):
        few = rng.uniform(-0.1, 0.1, (n, 3))
        spheres = hull_spheres(few, 30)
        gap = np.linalg.norm(few[:, None] - spheres[:, :3], axis=2) - spheres[:, 3]
        assert gap.min(axis=1).max() < 1e-9
