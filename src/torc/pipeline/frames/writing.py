"""Write frames, and what a camera saw, in either form."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, UInt16
from PIL import Image

from torc.io.record_files import to_plain
from torc.pipeline.frames.stored import HIDDEN, Frame
from torc.records import BACKGROUND, ROBOT, Capture, Observation

_DEPTH_UNITS_M = (0.0001, 0.001)
"""Units of depth.png as written here: 0.1 mm up to 6.5 m, else 1 mm; readings beyond 65 m are left out."""
_DEEPEST = 65535


def write_frame(path: Path, frame: Frame) -> None:
    """Write a frame, with its label image if it has one. Raises OSError if it cannot."""
    grid = frame.grid
    settings: dict[str, Any] = {
        "target_description": frame.target_description,
        "support_z_m": frame.support_z_m,
        "names": frame.names,
        "grid": {"origin": grid.origin, "voxel_size_m": grid.voxel_size_m, "shape": np.array(grid.shape)},
    }
    if frame.label_image is not None:
        settings["target"] = HIDDEN if frame.target_id is None else frame.target_id
    _write(path, frame.capture, settings)


def write_observation(path: Path, observation: Observation, target_description: str) -> None:
    """Write a snapshot without masks, support or grid. Raises OSError if it cannot."""
    _write(path, Capture(observation), {"target_description": target_description})


def _write(path: Path, capture: Capture, settings: Mapping[str, Any]) -> None:
    o, label = capture.observation, capture.label_image
    pair = o.pair
    told: dict[str, Any] = {"K": o.K, "T_world_camera": o.T_world_camera, **settings}
    if o.pose_estimated:
        told["pose_estimated"] = True
    images = {"rgb": o.rgb}
    if pair is not None:
        images |= {"left": pair.left, "right": pair.right}
        told["baseline_m"] = pair.baseline_m
    if path.suffix == ".npz":
        path.parent.mkdir(parents=True, exist_ok=True)
        grid = {f"grid_{k}": v for k, v in told.pop("grid", {}).items()}
        told.pop("names", None)
        if label is not None:
            told |= {"labels": label, "background": BACKGROUND, "robot": ROBOT}
        np.savez_compressed(path, **images, depth_m=o.depth_m, **told, **grid)  # type: ignore[arg-type]
        return
    path.mkdir(parents=True, exist_ok=True)
    depth, unit_m = _depth_pixels(o.depth_m)
    images["depth"] = depth
    if label is not None:
        images["labels"] = label.astype(np.uint8)
        told |= {"background": BACKGROUND % 256, "robot": ROBOT % 256}
    for name, image in images.items():
        Image.fromarray(image).save(path / f"{name}.png")
    data = {"version": 1, "depth_scale_m": unit_m, **told}
    (path / "frame.json").write_text(json.dumps(to_plain(data), indent=2) + "\n", encoding="utf-8")


def _depth_pixels(depth_m: Float32[np.ndarray, "h w"]) -> tuple[UInt16[np.ndarray, "h w"], float]:
    """Return depth as 16-bit numbers, and metres per unit: the finest of _DEPTH_UNITS_M that reaches far enough."""
    depth = np.nan_to_num(depth_m, nan=0.0, posinf=0.0, neginf=0.0)
    depth = np.where(depth <= _DEEPEST * _DEPTH_UNITS_M[-1], depth, 0)
    unit_m = next(u for u in _DEPTH_UNITS_M if depth.max() <= _DEEPEST * u)
    return np.round(depth / unit_m).astype(np.uint16), unit_m
