"""Good frames in both forms, with anything changed or left out."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from torc.geometry.transforms import wxyz_from_rotation
from torc.records import Capture, Observation
from torc.testing.contexts import box, small_mount
from torc.testing.synthetic import synthetic_capture
from torc.workspace.description import CameraMount

SHAPES = (
    box(0, 0.62, 0.0, (0.06, 0.06, 0.10)),
    box(1, 0.60, -0.2, (0.08, 0.06, 0.12)),
    box(2, 0.72, -0.1, (0.05, 0.05, 0.16)),
)


def capture(support_z_m: float = 1.05, mount: CameraMount | None = None) -> Capture:
    shapes = [replace(s, center=(*s.center[:2], s.center[2] + support_z_m - 1.05)) for s in SHAPES]
    return synthetic_capture(shapes, small_mount() if mount is None else mount, support_z_m)


def observe() -> Observation:
    return capture().observation


def true_labels() -> np.ndarray:
    label = capture().label_image
    assert label is not None
    return label


def arrays(seen: Capture | None = None) -> dict[str, Any]:
    seen = capture() if seen is None else seen
    o = seen.observation
    return {
        "rgb": o.rgb,
        "depth_m": o.depth_m,
        "K": o.K,
        "T_world_camera": o.T_world_camera,
        "labels": seen.label_image,
    }


def npz(path: Path, **changes: Any) -> Path:
    """A good .npz with some keys changed, or left out where None."""
    data = {k: v for k, v in (arrays() | changes).items() if v is not None}
    np.savez(path / "frame.npz", **data)
    return path / "frame.npz"


def directory(path: Path, **changes: Any) -> Path:
    """A good frame directory with some keys of frame.json changed, or left out where None."""
    o, folder = observe(), path / "frame"
    folder.mkdir()
    Image.fromarray(o.rgb).save(folder / "rgb.png")
    Image.fromarray(np.round(o.depth_m * 1000).astype(np.uint16)).save(folder / "depth.png")
    Image.fromarray((true_labels() + 1).astype(np.uint8)).save(folder / "labels.png")
    data = {
        "intrinsics": {"fx": o.K[0, 0], "fy": o.K[1, 1], "cx": o.K[0, 2], "cy": o.K[1, 2]},
        "camera_pose": {
            "position": o.T_world_camera[:3, 3].tolist(),
            "wxyz": wxyz_from_rotation(o.T_world_camera[:3, :3]).tolist(),
        },
        "target": 1,
        "names": {"1": "red mug", "2": "box"},
    }
    data = {k: v for k, v in (data | changes).items() if v is not None}
    (folder / "frame.json").write_text(json.dumps(data))
    return folder
