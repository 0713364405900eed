"""The surface under the objects, found in the image, and the grid that stands on it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from frame_makers import SHAPES, npz, observe

from torc.errors import InputError
from torc.pipeline.frames import load_frame
from torc.pipeline.frames.support_plane import estimate_support_z_m, grid_around
from torc.workspace.files import load_workspace


@pytest.mark.parametrize("support_z_m", [0.0, 0.4, 0.85, 1.05])
@pytest.mark.parametrize("noise_m", [0.0, 0.003])
def test_support_height_is_found_above_the_floor(
    support_z_m: float, noise_m: float, rng: np.random.Generator
) -> None:
    o = observe(support_z_m, load_workspace().camera)
    depth = o.depth_m + rng.normal(0, noise_m, o.depth_m.shape).astype(np.float32) * (o.depth_m > 0)
    assert estimate_support_z_m(replace(o, depth_m=depth)) == pytest.approx(support_z_m, abs=0.004)


def test_grid_covers_the_objects_and_stands_on_the_support(tmp_path: Path) -> None:
    frame = load_frame(npz(tmp_path))
    assert frame.support_estimated
    assert frame.grid.origin[2] == frame.support_z_m
    for shape in SHAPES:
        half = np.array(shape.size) / 2
        assert (np.array(shape.center) - half >= frame.grid.origin - 0.005).all()
        assert (np.array(shape.center) + half <= frame.grid.upper).all()


def test_grid_ignores_stray_points_but_not_a_wide_spread() -> None:
    points = np.random.default_rng(0).uniform(0, 0.3, (1000, 3))
    stray = np.concatenate([points, [[9, 9, 9], [-9, 9, 9]]])
    assert np.subtract(grid_around(stray, 0.0).shape, grid_around(points, 0.0).shape).max() <= 1
    with pytest.raises(InputError, match="spread"):
        grid_around(points * 20, 0.0)
