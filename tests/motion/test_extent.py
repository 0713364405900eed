"""A held object is taken to be as large as what nobody saw of it may be, and no larger."""

from dataclasses import replace

import numpy as np
import pytest

from torc.motion.holding import possible_points, unseen_below
from torc.records.volume import OcclusionVolume, VoxelGrid
from torc.testing.synthetic import SyntheticBox
from torc.testing.views import view_of, view_of_clutter
from torc.workspace.files import load_workspace

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
