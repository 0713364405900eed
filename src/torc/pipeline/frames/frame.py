"""A frame ready for the pipeline, and how frames are written, in either form."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float32, Int16, UInt16
from PIL import Image

from torc.errors import InputError
from torc.io.record_files import to_plain
from torc.records import BACKGROUND, ROBOT, Capture, Observation, VoxelGrid

HIDDEN = "hidden"
"""Value of `target` while the target is not in sight."""
_DEPTH_UNITS_M = (0.0001, 0.001)
"""Units of depth.png as written here: 0.1 mm up to 6.5 m, else 1 mm; readings beyond 65 m are left out."""
_DEEPEST = 65535


@dataclass(frozen=True)
class Frame:
    """One frame, ready for the pipeline.

    Attributes:
        observation: the snapshot.
        label_image: the masks: object id per pixel, 0 to 63, the target being 0. None without masks: a perception then
            has to find the objects.
        target_id: TARGET_ID, or None while the target is hidden or unknown.
        support_z_m: height of the surface that the objects stand on.
        grid: region of the occlusion volume.
        labels, names: label in the file per object id, and name if the file has one.
        warnings: messages for the user: how the file was understood, and what looks wrong in it.
    """

    observation: Observation
    target_id: int | None
    target_description: str
    support_z_m: float
    grid: VoxelGrid
    labels: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    label_image: Int16[np.ndarray, "h w"] | None = None
    support_estimated: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def capture(self) -> Capture:
        """The snapshot with its masks."""
        return Capture(self.observation, self.label_image)

    @property
    def pose_estimated(self) -> bool:
        """True if the pose was estimated; grasps are then not in the robot's base frame."""
        return self.observation.pose_estimated


def save_frame(path: str | Path, frame: Frame) -> None:
    """Write a frame for `load_frame`. Labels are written as object ids.

    Args:
        path: a path that ends in .npz, or a directory, which is made. A directory rounds depth to 0.1 mm, or to 1 mm if
            some is beyond 6.5 m; an .npz file has no names.
        frame: the frame.

    Raises:
        InputError: it cannot be written.
    """
    grid = frame.grid
    settings: dict[str, Any] = {
        "target_description": frame.target_description,
        "support_z_m": frame.support_z_m,
        "names": frame.names,
        "grid": {"origin": grid.origin, "voxel_size_m": grid.voxel_size_m, "shape": np.array(grid.shape)},
    }
    if frame.label_image is not None:
        settings["target"] = HIDDEN if frame.target_id is None else frame.target_id
    _write(Path(path), frame.capture, settings)


def save_observation(path: str | Path, observation: Observation, target_description: str = "") -> None:
    """Write a snapshot as a frame without support and grid; its reader finds them. Raises as `save_frame`."""
    _write(Path(path), Capture(observation), {"target_description": target_description})


def _write(path: Path, capture: Capture, settings: Mapping[str, Any]) -> None:
    o = capture.observation
    values: dict[str, Any] = {"K": o.K, "T_world_camera": o.T_world_camera, **settings}
    if o.pose_estimated:
        values["pose_estimated"] = True
    images = {"rgb": o.rgb}
    if o.pair is not None:
        images |= {"left": o.pair.left, "right": o.pair.right}
        values["baseline_m"] = o.pair.baseline_m
    write = _write_file if path.suffix == ".npz" else _write_directory
    try:
        write(path, capture, images, values)
    except OSError as error:
        raise InputError(f"Cannot write the frame to '{path}': {error}.") from error


def _write_file(path: Path, capture: Capture, images: dict[str, np.ndarray], values: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    grid = {f"grid_{k}": v for k, v in values.pop("grid", {}).items()}
    values.pop("names", None)
    if capture.label_image is not None:
        values |= {"labels": capture.label_image, "background": BACKGROUND, "robot": ROBOT}
    np.savez_compressed(path, **images, depth_m=capture.observation.depth_m, **values, **grid)  # type: ignore[arg-type]


def _write_directory(
    path: Path, capture: Capture, images: dict[str, np.ndarray], values: dict[str, Any]
) -> None:
    path.mkdir(parents=True, exist_ok=True)
    images["depth"], unit_m = _depth_pixels(capture.observation.depth_m)
    if capture.label_image is not None:
        images["labels"] = capture.label_image.astype(np.uint8)
        values |= {"background": BACKGROUND % 256, "robot": ROBOT % 256}
    for name, image in images.items():
        Image.fromarray(image).save(path / f"{name}.png")
    data = {"version": 1, "depth_scale_m": unit_m, **values}
    (path / "frame.json").write_text(json.dumps(to_plain(data), indent=2) + "\n", encoding="utf-8")


def _depth_pixels(depth_m: Float32[np.ndarray, "h w"]) -> tuple[UInt16[np.ndarray, "h w"], float]:
    """Return depth as 16-bit numbers, and metres per unit: the finest of _DEPTH_UNITS_M that reaches far enough."""
    depth = np.nan_to_num(depth_m, nan=0.0, posinf=0.0, neginf=0.0)
    depth = np.where(depth <= _DEEPEST * _DEPTH_UNITS_M[-1], depth, 0)
    unit_m = next(u for u in _DEPTH_UNITS_M if depth.max() <= _DEEPEST * u)
    return np.round(depth / unit_m).astype(np.uint16), unit_m
