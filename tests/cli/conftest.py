"""Somebody's frame, and somebody's parts."""

import numpy as np
import pytest

from torc.testing.synthetic import SyntheticBox, synthetic_capture


@pytest.fixture
def frame(tmp_path):
    """A box before the target, as a file."""
    shapes = [
        SyntheticBox(0, (0.66, -0.33, 1.08), (0.05, 0.05, 0.06)),
        SyntheticBox(1, (0.58, -0.12, 1.15), (0.05, 0.14, 0.20)),
    ]
    capture = synthetic_capture(shapes)
    o = capture.observation
    arrays = {"rgb": o.rgb, "depth_m": o.depth_m, "K": o.K, "T_world_camera": o.T_world_camera}
    np.savez(tmp_path / "frame.npz", **arrays, labels=capture.label_image + 1, target=1)
    return tmp_path / "frame.npz"
