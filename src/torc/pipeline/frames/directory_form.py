"""Frames as a directory: rgb.png, depth.png, labels.png and frame.json."""

import difflib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int16
from PIL import Image, UnidentifiedImageError

from torc.errors import InputError
from torc.geometry.transforms import make_pose, rotation_from_wxyz
from torc.pipeline.frames.record import HIDDEN, SETTINGS, Frame, RawFrame
from torc.pipeline.frames.values import (
    as_color,
    as_labels,
    as_matrix,
    as_number,
    check_regular,
    check_size,
    scaled_depth,
)
from torc.records import ROBOT

_JSON_KEYS = frozenset(
    {
        "version",
        "K",
        "intrinsics",
        "T_world_camera",
        "camera_pose",
        "depth_scale_m",
        "names",
        "grid",
        *SETTINGS,
    }
)
_BACKGROUND_PIXEL, _ROBOT_PIXEL = 255, 254
"""Of labels.png as written here; object ids stay what they are."""
_DEPTH_UNIT_M = 0.0001
"""Of depth.png as written here: 0.1 mm, up to 6.5 m."""


def read_directory(path: Path) -> RawFrame:
    """The frame in a directory. Raises InputError, naming file and key, where there is none."""
    for name in ("frame.json", "rgb.png", "depth.png", "labels.png"):
        check_regular(path / name)
    data, where = _read_json(path / "frame.json"), str(path / "frame.json")
    unknown = sorted(set(data) - _JSON_KEYS)
    if unknown:
        near = difflib.get_close_matches(unknown[0], _JSON_KEYS, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else f" Known: {', '.join(sorted(_JSON_KEYS))}."
        raise InputError(f"{where}: unknown key '{unknown[0]}'.{hint}")
    if data.get("version", 1) != 1:
        raise InputError(f"{where}: version {data['version']}; this torc reads version 1.")
    scale = data.get("depth_scale_m", 0.001)
    return RawFrame(
        where,
        as_color(str(path / "rgb.png"), _read_image(path / "rgb.png", "RGB")),
        scaled_depth(str(path / "depth.png"), _read_image(path / "depth.png"), scale, "depth_scale_m"),
        as_labels(str(path / "labels.png"), _read_image(path / "labels.png")),
        _intrinsics(where, data),
        _camera_pose(where, data),
        {k: data[k] for k in (*SETTINGS, "names", "grid") if k in data},
    )


def _read_json(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"{path} is missing; a frame's directory holds rgb.png, depth.png, labels.png, frame.json."
        ) from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise InputError(f"Cannot read {path}: {error}.") from error
    if not isinstance(data, dict):
        raise InputError(f"{path} must hold a JSON object, not a {type(data).__name__}.")
    return data


def _read_image(path: Path, mode: str | None = None) -> np.ndarray:
    try:
        with Image.open(path) as image:
            check_size(str(path), (image.height, image.width))
            return np.array(image.convert(mode) if mode else image)
    except FileNotFoundError:
        raise InputError(
            f"{path} is missing; a frame's directory holds rgb.png, depth.png, labels.png, frame.json."
        ) from None
    except (OSError, UnidentifiedImageError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"Cannot read the image {path}: {error}.") from error


def _intrinsics(where: str, data: Mapping[str, Any]) -> Float[np.ndarray, "3 3"]:
    if "K" in data:
        return as_matrix(f"{where}, key K", data["K"], (3, 3))
    given = data.get("intrinsics")
    if not isinstance(given, dict) or not {"fx", "fy", "cx", "cy"} <= set(given):
        raise InputError(f"{where}, key intrinsics: need fx, fy, cx, cy in pixels (or K, a 3x3 matrix).")
    fx, fy, cx, cy = (as_number(f"{where}, key intrinsics.{k}", given[k]) for k in ("fx", "fy", "cx", "cy"))
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def _camera_pose(where: str, data: Mapping[str, Any]) -> Float[np.ndarray, "4 4"]:
    given = data.get("T_world_camera", data.get("camera_pose"))
    if isinstance(given, dict):
        if not {"position", "wxyz"} <= set(given):
            raise InputError(f"{where}, key camera_pose: need position (3) and wxyz (4), or a 4x4 matrix.")
        position = as_matrix(f"{where}, key camera_pose.position", given["position"], (3,))
        wxyz = as_matrix(f"{where}, key camera_pose.wxyz", given["wxyz"], (4,))
        if abs(np.linalg.norm(wxyz) - 1) > 1e-2:
            raise InputError(
                f"{where}, key camera_pose.wxyz: {wxyz.tolist()} is no unit quaternion (w first)."
            )
        return make_pose(rotation_from_wxyz(wxyz), position)
    if given is None:
        raise InputError(
            f"{where} lacks camera_pose: a 4x4 matrix, or position and wxyz (world from camera, OpenCV axes)."
        )
    return as_matrix(f"{where}, key camera_pose", given, (4, 4))


def write_directory(path: Path, frame: Frame, label: Int16[np.ndarray, "h w"]) -> None:
    """Writes a frame with its label image; depth is rounded to 0.1 mm. Raises OSError where it cannot, and
    InputError for depth beyond 6.5 m."""
    o = frame.observation
    if o.depth_m.max() > 65535 * _DEPTH_UNIT_M:
        raise InputError("Depth beyond 6.5 m does not fit depth.png; save this frame as .npz.")
    path.mkdir(parents=True, exist_ok=True)
    pixels = np.where(label >= 0, label, np.where(label == ROBOT, _ROBOT_PIXEL, _BACKGROUND_PIXEL)).astype(
        np.uint8
    )
    Image.fromarray(o.rgb).save(path / "rgb.png")
    Image.fromarray(np.round(o.depth_m / _DEPTH_UNIT_M).astype(np.uint16)).save(path / "depth.png")
    Image.fromarray(pixels).save(path / "labels.png")
    data = {
        "version": 1,
        "K": o.K.tolist(),
        "camera_pose": o.T_world_camera.tolist(),
        "depth_scale_m": _DEPTH_UNIT_M,
        "background": _BACKGROUND_PIXEL,
        "robot": _ROBOT_PIXEL,
        "target": HIDDEN if frame.target_id is None else frame.target_id,
        "target_description": frame.target_description,
        "support_z_m": frame.support_z_m,
        "names": {str(i): name for i, name in frame.names.items()},
        "grid": {
            "origin": frame.grid.origin.tolist(),
            "voxel_size_m": frame.grid.voxel_size_m,
            "shape": list(frame.grid.shape),
        },
    }
    (path / "frame.json").write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
