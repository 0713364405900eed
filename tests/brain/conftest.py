"""A frame whose labels are anything but torc's ids."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from torc.brain import load_frame
from torc.geometry.transforms import look_at
from torc.pipeline.frames import Frame
from torc.records import BACKGROUND
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_capture
from torc.workspace.description import CameraMount

SHAPES = (
    box(0, 0.72, -0.02, (0.05, 0.05, 0.08)),
    box(1, 0.58, -0.12, (0.04, 0.12, 0.14)),
    box(2, 0.60, 0.05, (0.05, 0.05, 0.10)),
)
LABELS = {BACKGROUND: 0, 0: 512, 1: 7, 2: 40_000}


def mount_at(distance_m: float) -> CameraMount:
    """A camera that sees the objects under the same angle and about as large from any distance."""
    slant = np.deg2rad(25)
    eye = (0.62 - distance_m * np.cos(slant), 0.0, 1.1 + distance_m * np.sin(slant))
    return CameraMount(look_at(eye, (0.62, 0.0, 1.1)), 320, 240, float(2 * np.arctan(0.5 / distance_m)))


@pytest.fixture
def frame_of(tmp_path: Path) -> Callable[..., Frame]:
    """The frame from a distance, with a speck labelled 23 and whatever else is wanted in the file."""

    def make(distance_m: float = 1.0, support_z_m: float = 1.05, **settings) -> Frame:
        shapes = [box(s.id, *s.center[:2], s.size, on=support_z_m - 1.05) for s in SHAPES]
        capture = synthetic_capture(shapes, mount_at(distance_m), support_z_m)
        o, labels = capture.observation, np.vectorize(LABELS.get)(capture.label_image)
        labels[0, :3] = 23
        arrays = {"rgb": o.rgb, "depth_m": o.depth_m, "K": o.K, "T_world_camera": o.T_world_camera}
        np.savez(tmp_path / "frame.npz", **({**arrays, "labels": labels, "target": 512} | settings))
        return load_frame(tmp_path / "frame.npz")

    return make
