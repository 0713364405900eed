"""A held object is taken to be as large as what nobody saw of it may be, and no larger."""

from dataclasses import replace

import numpy as np
import pytest

from torc.motion.holding import hull_spheres, possible_points, unseen_below
from torc.records.volume import OcclusionVolume, VoxelGrid
from torc.testing.synthetic import SyntheticBox
from torc.testing.views import view_of, view_of_clutter
from torc.workspace.workspace_files import load_workspace

TABLE = load_workspace().support_z_m
CAMERA = load_workspace().camera.T_world_camera[:3, 3]


def standing(object_id: int, x: float, y: float, size: tuple[float, float, float]) -> SyntheticBox:
    return SyntheticBox(object_id, (x, y, TABLE + size[2] / 2), size)


def test_an_object_whose_foot_is_hidden_reaches_down_to_the_table():
    view = view_of(standing(1, 0.70, -0.10, (0.05, 0.05, 0.20)), standing(2, 0.58, -0.10, (0.04, 0.16, 0.12)))
    behind = view.scene.object(1)
    assert behind.points[:, 2].min() > TABLE + 0.05
    possible = possible_points(behind, CAMERA, view.volume, TABLE)
    assert possible[:, 2].min() == pytest.approx(TABLE, abs=1e-9)
    assert possible[:, 2].max() == pytest.approx(TABLE + 0.20, abs=0.005)
    # Straight down: it does not spread over the shadow of what stands in front of it.
    assert np.all(np.abs(possible[:, :2] - (0.70, -0.10)) < 0.025 + view.volume.grid.voxel_size_m)


def test_nothing_is_possible_below_what_was_seen_to_be_free():
    view = view_of(SyntheticBox(1, (0.65, -0.1, TABLE + 0.2), (0.05, 0.05, 0.05)))
    o, seen = view.scene.object(1), replace(view.volume, seen=np.ones_like(view.volume.seen))
    floating = possible_points(o, CAMERA, seen, TABLE)
    assert floating[:, 2].min() > TABLE + 0.17
    assert possible_points(o, CAMERA, view.volume, TABLE)[:, 2].min() <= floating[:, 2].min()


@pytest.mark.parametrize("seed", range(5))
def test_unseen_space_below_ends_where_brute_force_says(seed):
    volume = view_of_clutter(seed, 9).volume
    rng, grid = np.random.default_rng(seed), volume.grid
    points = rng.uniform(grid.origin - 0.05, grid.upper + 0.05, (400, 3))
    for own in (0, 3, 40):
        got = {tuple(np.round(p, 6)) for p in unseen_below(points, own, volume)}
        assert got == {tuple(np.round(p, 6)) for p in expected_ends(points, own, volume)}
        assert got


def expected_ends(points: np.ndarray, own: int, volume: OcclusionVolume) -> list[np.ndarray]:
    grid: VoxelGrid = volume.grid
    lowest: dict[tuple[int, int], int] = {}
    for i, j, k in grid.index_of(points).tolist():
        if grid.contains(np.array([i, j, k])):
            lowest[i, j] = min(k, lowest.get((i, j), k))
    ends = []
    for (i, j), top in lowest.items():
        k = top
        while k > 0 and (not volume.seen[i, j, k - 1] or volume.surface_label[i, j, k - 1] == own):
            k -= 1
        if k < top:
            ends.append(grid.origin + grid.voxel_size_m * np.array([i + 0.5, j + 0.5, k]))
    return ends


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
