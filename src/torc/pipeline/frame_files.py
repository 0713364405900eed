"""Reading saved RGB-D frames from disk: one .npz file, or a directory with images and frame.json.

What comes out is raw: arrays of the right kind, one size and plausible amount. `torc.pipeline.frames` makes sense of
them. Whatever is wrong ends in an InputError that names file, key and remedy.
"""

import difflib
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int64, UInt8
from PIL import Image, UnidentifiedImageError

from torc.errors import InputError
from torc.geometry.transforms import make_pose, rotation_from_wxyz
from torc.records import VoxelGrid

MAX_SIDE_PX, MIN_SIDE_PX = 8192, 16
MAX_PIXELS = 20_000_000
MAX_ARRAY_BYTES = 512 * 2**20
_REQUIRED_ARRAYS = ("rgb", "K", "T_world_camera", "labels")
_SETTINGS = ("target", "target_description", "support_z_m", "background", "robot")
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
        *_SETTINGS,
    }
)


@dataclass(frozen=True)
class RawFrame:
    """A frame as it was stored.

    Attributes:
        where: the file, for messages.
        rgb: colour image.
        depth_m: metres; NaN, infinite or 0 where there is no reading.
        labels: instance per pixel, in the file's own numbers.
        K: intrinsics.
        T_world_camera: camera pose, not yet checked.
        settings: whatever is optional, by key.
    """

    where: str
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    labels: Int64[np.ndarray, "h w"]
    K: Float[np.ndarray, "3 3"]
    T_world_camera: Float[np.ndarray, "4 4"]
    settings: Mapping[str, Any]


def read_raw(path: Path) -> RawFrame:
    """The frame at a .npz file or directory. Raises InputError where it cannot be read."""
    if path.is_dir():
        raw = _read_directory(path)
    elif not path.exists():
        raise InputError(f"There is no frame '{path}'. Give a .npz file, or a directory with frame.json.")
    elif path.suffix == ".npz":
        raw = _read_npz(path)
    else:
        raise InputError(
            f"'{path}' is neither a .npz file nor a directory with rgb.png, depth.png, labels.png, frame.json."
        )
    shapes = {"rgb": raw.rgb.shape[:2], "depth": raw.depth_m.shape, "labels": raw.labels.shape}
    if len(set(shapes.values())) != 1:
        sizes = ", ".join(f"{k} {s[1]}x{s[0]}" for k, s in shapes.items())
        raise InputError(f"{raw.where}: image sizes differ ({sizes}). Register all three to one camera.")
    return raw


def check_size(where: str, shape: tuple[int, ...]) -> None:
    """Raises InputError for images that are tiny or huge."""
    h, w = shape[:2]
    if min(h, w) < MIN_SIDE_PX or max(h, w) > MAX_SIDE_PX or h * w > MAX_PIXELS:
        raise InputError(
            f"{where} is {w}x{h} pixels; sides must be {MIN_SIDE_PX}..{MAX_SIDE_PX} and at most "
            f"{MAX_PIXELS // 10**6} megapixels in all. Scale the images and K."
        )


# --- .npz -----------------------------------------------------------------------------------------------------------


def _read_npz(path: Path) -> RawFrame:
    arrays = _npz_arrays(path)
    where = str(path)
    missing = [k for k in _REQUIRED_ARRAYS if k not in arrays]
    if missing:
        raise InputError(
            f"{where} lacks {', '.join(missing)}; it holds {', '.join(sorted(arrays)) or 'nothing'}."
        )
    settings = {k: _plain(where, k, arrays[k]) for k in _SETTINGS if k in arrays}
    grid_keys = ("grid_origin", "grid_voxel_size_m", "grid_shape")
    if any(k in arrays for k in grid_keys):
        if not all(k in arrays for k in grid_keys):
            raise InputError(f"{where}: a grid needs all of {', '.join(grid_keys)}.")
        origin, size, shape = (arrays[k].tolist() for k in grid_keys)
        settings["grid"] = {"origin": origin, "voxel_size_m": size, "shape": shape}
    return RawFrame(
        where,
        _color(f"{where}, key rgb", arrays["rgb"]),
        _npz_depth(where, arrays),
        _labels(f"{where}, key labels", arrays["labels"]),
        _matrix(f"{where}, key K", arrays["K"], (3, 3)),
        _matrix(f"{where}, key T_world_camera", arrays["T_world_camera"], (4, 4)),
        settings,
    )


def _npz_arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        with zipfile.ZipFile(path) as archive:
            large = [i.filename for i in archive.infolist() if i.file_size > MAX_ARRAY_BYTES]
        if large:
            raise InputError(
                f"{path}: {', '.join(large)} is larger than {MAX_ARRAY_BYTES // 2**20} MB unpacked."
            )
        with np.load(path, allow_pickle=False) as data:
            return {k: data[k] for k in data.files}
    except (OSError, zipfile.BadZipFile, EOFError, MemoryError) as error:
        raise InputError(f"Cannot read {path}: {error}. Write it with numpy.savez_compressed.") from error
    except ValueError as error:
        hint = "Python objects are not read; store plain arrays." if "pickle" in str(error) else ""
        raise InputError(f"Cannot read an array of {path}: {error}. {hint}".strip()) from error


def _npz_depth(where: str, arrays: Mapping[str, np.ndarray]) -> Float32[np.ndarray, "h w"]:
    if "depth_m" in arrays:
        depth = arrays["depth_m"]
        if depth.ndim != 2 or depth.dtype.kind != "f":
            raise InputError(
                f"{where}, key depth_m: {depth.dtype} {depth.shape}; need floats (h, w) in metres. Integers go into "
                "the key depth, with depth_scale."
            )
        return depth.astype(np.float32)
    if "depth" not in arrays:
        raise InputError(f"{where} lacks depth_m (floats, metres), or depth (integers) with depth_scale.")
    scale = _plain(where, "depth_scale", arrays["depth_scale"]) if "depth_scale" in arrays else 0.001
    return _scaled_depth(f"{where}, key depth", arrays["depth"], scale, "depth_scale")


def _plain(where: str, key: str, array: np.ndarray) -> Any:
    """A Python number or text out of an array with one element."""
    if array.size != 1 or array.dtype.kind not in "iufUb":
        raise InputError(
            f"{where}, key {key}: need one number or text, not {array.dtype} of shape {array.shape}."
        )
    return array.reshape(()).item()


# --- directory ------------------------------------------------------------------------------------------------------


def _read_directory(path: Path) -> RawFrame:
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
        _color(str(path / "rgb.png"), _read_image(path / "rgb.png", "RGB")),
        _scaled_depth(str(path / "depth.png"), _read_image(path / "depth.png"), scale, "depth_scale_m"),
        _labels(str(path / "labels.png"), _read_image(path / "labels.png")),
        _intrinsics(where, data),
        _camera_pose(where, data),
        {k: data[k] for k in (*_SETTINGS, "names", "grid") if k in data},
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
        return _matrix(f"{where}, key K", data["K"], (3, 3))
    given = data.get("intrinsics")
    if not isinstance(given, dict) or not {"fx", "fy", "cx", "cy"} <= set(given):
        raise InputError(f"{where}, key intrinsics: need fx, fy, cx, cy in pixels (or K, a 3x3 matrix).")
    fx, fy, cx, cy = (_number(f"{where}, key intrinsics.{k}", given[k]) for k in ("fx", "fy", "cx", "cy"))
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def _camera_pose(where: str, data: Mapping[str, Any]) -> Float[np.ndarray, "4 4"]:
    given = data.get("T_world_camera", data.get("camera_pose"))
    if isinstance(given, dict):
        if not {"position", "wxyz"} <= set(given):
            raise InputError(f"{where}, key camera_pose: need position (3) and wxyz (4), or a 4x4 matrix.")
        position = _matrix(f"{where}, key camera_pose.position", given["position"], (3,))
        wxyz = _matrix(f"{where}, key camera_pose.wxyz", given["wxyz"], (4,))
        if abs(np.linalg.norm(wxyz) - 1) > 1e-2:
            raise InputError(
                f"{where}, key camera_pose.wxyz: {wxyz.tolist()} is no unit quaternion (w first)."
            )
        return make_pose(rotation_from_wxyz(wxyz), position)
    if given is None:
        raise InputError(
            f"{where} lacks camera_pose: a 4x4 matrix, or position and wxyz (world from camera, OpenCV axes)."
        )
    return _matrix(f"{where}, key camera_pose", given, (4, 4))


# --- both -----------------------------------------------------------------------------------------------------------


def _color(where: str, rgb: np.ndarray) -> UInt8[np.ndarray, "h w 3"]:
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
        raise InputError(f"{where}: {rgb.dtype} {rgb.shape}; need uint8 of shape (h, w, 3), red first.")
    check_size(where, rgb.shape)
    return rgb


def _labels(where: str, labels: np.ndarray) -> Int64[np.ndarray, "h w"]:
    if labels.ndim != 2 or labels.dtype.kind not in "iu":
        raise InputError(
            f"{where}: {labels.dtype} {labels.shape}; need integers of shape (h, w), one instance number per pixel. "
            "A colour-coded picture has to be turned into numbers first."
        )
    return labels.astype(np.int64)


def _scaled_depth(where: str, depth: np.ndarray, scale: Any, scale_key: str) -> Float32[np.ndarray, "h w"]:
    if depth.ndim != 2 or depth.dtype.kind not in "iu" or depth.dtype.itemsize < 2:
        raise InputError(
            f"{where}: {depth.dtype} {depth.shape}; need integers of 16 bits or more, shape (h, w)."
        )
    factor = _number(f"{where}, {scale_key}", scale)
    if not 1e-6 <= factor <= 0.1:
        raise InputError(f"{where}: {scale_key} is {factor} metres per unit; 0.001 means millimetres.")
    return (depth * factor).astype(np.float32)


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise InputError(f"{where}: {value!r} is not a finite number.")
    return float(value)


def _matrix(where: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(f"{where}: need {'x'.join(map(str, shape))} finite numbers, not {str(value)[:120]}.")
    return array


def as_grid(where: str, value: Any) -> VoxelGrid:
    """The voxel grid that frame.json's `grid` describes. Raises InputError where it does not describe one."""
    if not isinstance(value, dict) or set(value) != {"origin", "voxel_size_m", "shape"}:
        raise InputError(f"{where}, key grid: need origin (3), voxel_size_m and shape (3).")
    origin = _matrix(f"{where}, key grid.origin", value["origin"], (3,))
    size = _number(f"{where}, key grid.voxel_size_m", value["voxel_size_m"])
    shape = _matrix(f"{where}, key grid.shape", value["shape"], (3,))
    whole = bool((shape == np.round(shape)).all() and (shape >= 1).all() and (shape <= 1000).all())
    if not whole or not 0.001 <= size <= 0.1 or shape.prod() > 20e6:
        raise InputError(
            f"{where}, key grid: {shape.tolist()} voxels of {size} m; need whole numbers, 1..1000 a side, 20 million "
            "in all, of 0.001..0.1 m."
        )
    return VoxelGrid(origin, size, (int(shape[0]), int(shape[1]), int(shape[2])))


def as_number(where: str, key: str, value: Any) -> float:
    """A finite number out of a setting. Raises InputError for anything else."""
    return _number(f"{where}, key {key}", value)
