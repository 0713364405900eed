"""The two forms of a stored frame: a directory with rgb.png, depth.png, labels.png, frame.json; a .npz file."""

import difflib
import json
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float32, Int16, Int64, UInt8
from PIL import Image
from pydantic import BaseModel, BeforeValidator, ConfigDict

from torc.errors import InputError
from torc.files.strict_yaml import Number
from torc.geometry.transforms import make_pose, rotation_from_wxyz
from torc.pipeline.frames.record import HIDDEN, SETTINGS, Frame, RawFrame, Settings, finite
from torc.records import BACKGROUND, ROBOT

MAX_SIDE_PX, MIN_SIDE_PX = 8192, 16
MAX_PIXELS = 20_000_000
MAX_ARRAY_BYTES = 512 * 2**20
FILES = ("frame.json", "rgb.png", "depth.png", "labels.png")
REQUIRED_ARRAYS = ("rgb", "K", "T_world_camera", "labels")
_GRID_KEYS = ("grid_origin", "grid_voxel_size_m", "grid_shape")
OPTIONAL_ARRAYS = ("depth_m", "depth", "depth_scale", *SETTINGS, *_GRID_KEYS)
_BACKGROUND_PIXEL, _ROBOT_PIXEL = 255, 254
"""Of labels.png as written here; object ids stay what they are."""
_DEPTH_UNIT_M = 0.0001
"""Of depth.png as written here: 0.1 mm, up to 6.5 m."""


def _pose(given: Any) -> np.ndarray:
    """A camera pose: a matrix, or position and unit quaternion."""
    if not isinstance(given, dict):
        return finite(given, 4, 4)
    if not {"position", "wxyz"} <= set(given):
        raise ValueError("need position (3) and wxyz (4), or a 4x4 matrix")
    wxyz = finite(given["wxyz"], 4)
    if abs(np.linalg.norm(wxyz) - 1) > 1e-2:
        raise ValueError(f"{wxyz.tolist()} is no unit quaternion (w first)")
    return make_pose(rotation_from_wxyz(wxyz), finite(given["position"], 3))


class Intrinsics(BaseModel):
    """Pixels."""

    fx: Number
    fy: Number
    cx: Number
    cy: Number


class FrameJson(Settings):
    """What frame.json holds."""

    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)
    version: Any = 1
    K: Annotated[Any, BeforeValidator(lambda given: finite(given, 3, 3))] = None
    intrinsics: Intrinsics | None = None
    T_world_camera: Annotated[Any, BeforeValidator(_pose)] = None
    camera_pose: Annotated[Any, BeforeValidator(_pose)] = None
    depth_scale_m: Number = 0.001


def read_directory(path: Path) -> RawFrame:
    """The frame in a directory. Raises InputError, naming file and key, where there is none."""
    for name in FILES:
        _check_regular(path / name)
    missing = [name for name in FILES if not (path / name).exists()]
    if missing:
        raise InputError(f"{path} lacks {', '.join(missing)}; a frame's directory holds {', '.join(FILES)}.")
    where = str(path / "frame.json")
    try:
        data = json.loads((path / "frame.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"Cannot read {where}: {error}.") from error
    if not isinstance(data, dict):
        raise InputError(f"{where} must hold a JSON object, not a {type(data).__name__}.")
    _refuse_misspelt(where, data, FrameJson.model_fields, cutoff=0.6)
    if data.get("version", 1) != 1:
        raise InputError(f"{where}: version {data['version']}; this torc reads version 1.")
    given = FrameJson.checked(where, data)
    K, pose = given.K, given.camera_pose if given.T_world_camera is None else given.T_world_camera
    if K is None:
        if given.intrinsics is None:
            raise InputError(f"{where} lacks intrinsics: fx, fy, cx, cy in pixels (or K, a 3x3 matrix).")
        i = given.intrinsics
        K = np.array([[i.fx, 0, i.cx], [0, i.fy, i.cy], [0, 0, 1.0]])
    if pose is None:
        raise InputError(
            f"{where} lacks camera_pose: a 4x4 matrix, or position and wxyz (world from camera, OpenCV axes)."
        )
    rgb, depth, labels = (_read_image(path / name) for name in FILES[1:])
    depth_m = _scaled(str(path / "depth.png"), depth, given.depth_scale_m, "depth_scale_m")
    return RawFrame(where, rgb, depth_m, _instances(str(path / "labels.png"), labels), K, pose, given)


def read_npz(path: Path) -> RawFrame:
    """The frame in a .npz file. Raises InputError, naming file and key, where there is none."""
    _check_regular(path)
    arrays, where = _npz_arrays(path), str(path)
    missing = [k for k in REQUIRED_ARRAYS if k not in arrays]
    if missing:
        held = ", ".join(sorted(arrays)) or "nothing"
        raise InputError(f"{where} lacks {', '.join(missing)}; it holds {held}.")
    _refuse_misspelt(where, set(arrays) - {*REQUIRED_ARRAYS}, OPTIONAL_ARRAYS, cutoff=0.85)
    settings = {k: _plain(where, k, arrays[k]) for k in SETTINGS if k in arrays}
    if any(k in arrays for k in _GRID_KEYS):
        if not all(k in arrays for k in _GRID_KEYS):
            raise InputError(f"{where}: a grid needs all of {', '.join(_GRID_KEYS)}.")
        origin, size, shape = (arrays[k].tolist() for k in _GRID_KEYS)
        settings["grid"] = {"origin": origin, "voxel_size_m": size, "shape": shape}
    rgb = arrays["rgb"]
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
        raise InputError(f"{where}, key rgb: {rgb.dtype} {rgb.shape}; need uint8 (h, w, 3), red first.")
    _check_size(f"{where}, key rgb", rgb.shape)
    try:
        K, pose = finite(arrays["K"], 3, 3), finite(arrays["T_world_camera"], 4, 4)
    except ValueError as error:
        raise InputError(f"{where}, key K or T_world_camera: {error}.") from None
    labels = _instances(f"{where}, key labels", arrays["labels"])
    return RawFrame(where, rgb, _npz_depth(where, arrays), labels, K, pose, Settings.checked(where, settings))


def _check_regular(path: Path) -> None:
    """Refuses what is there and no regular file: reading a pipe would wait for ever."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is no regular file. Store the frame in one, and give that.")


def _refuse_misspelt(where: str, keys: Iterable[str], known: Iterable[str], cutoff: float) -> None:
    """Refuses unknown keys that were clearly meant to be a known one."""
    absent = [k for k in known if k not in keys]
    for key in sorted(set(keys) - {*known}):
        near = difflib.get_close_matches(key, absent, n=1, cutoff=cutoff)
        if near:
            raise InputError(f"{where}: unknown key '{key}'. Did you mean '{near[0]}'?")


def _check_size(where: str, shape: tuple[int, ...]) -> None:
    """Refuses images that are tiny or huge."""
    h, w = shape[:2]
    if min(h, w) < MIN_SIDE_PX or max(h, w) > MAX_SIDE_PX or h * w > MAX_PIXELS:
        raise InputError(
            f"{where} is {w}x{h} pixels; sides must be {MIN_SIDE_PX}..{MAX_SIDE_PX} and at most "
            f"{MAX_PIXELS // 10**6} megapixels in all. Scale the images and K."
        )


def _read_image(path: Path) -> UInt8[np.ndarray, "h w 3"] | np.ndarray:
    """The pixels of a picture; rgb.png in colour, the others as they are."""
    try:
        with Image.open(path) as image:
            _check_size(str(path), (image.height, image.width))
            return np.array(image.convert("RGB") if path.name == "rgb.png" else image)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"Cannot read the image {path}: {error}.") from error


def _instances(where: str, labels: np.ndarray) -> Int64[np.ndarray, "h w"]:
    """An instance number per pixel."""
    if labels.ndim != 2 or labels.dtype.kind not in "iu":
        raise InputError(
            f"{where}: {labels.dtype} {labels.shape}; need integers of shape (h, w), one instance number per pixel. "
            "A colour-coded picture has to be turned into numbers first."
        )
    return labels.astype(np.int64)


def _scaled(where: str, depth: np.ndarray, scale: Any, scale_key: str) -> Float32[np.ndarray, "h w"]:
    """Depth in metres out of whole numbers and metres per unit."""
    if depth.ndim != 2 or depth.dtype.kind not in "iu" or depth.dtype.itemsize < 2:
        raise InputError(
            f"{where}: {depth.dtype} {depth.shape}; need integers of 16 bits or more, shape (h, w)."
        )
    if not isinstance(scale, (int, float)) or not 1e-6 <= scale <= 0.1:
        raise InputError(f"{where}: {scale_key} is {scale} metres per unit; 0.001 means millimetres.")
    return (depth * float(scale)).astype(np.float32)


def _npz_arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        with zipfile.ZipFile(path) as archive:
            large = [i.filename for i in archive.infolist() if i.file_size > MAX_ARRAY_BYTES]
        if large:
            most = MAX_ARRAY_BYTES // 2**20
            raise InputError(f"{path}: {', '.join(large)} is larger than {most} MB unpacked.")
        with np.load(path, allow_pickle=False) as data:
            return {k: data[k] for k in data.files}
    except (OSError, zipfile.BadZipFile, EOFError, MemoryError) as error:
        raise InputError(f"Cannot read {path}: {error}. Write it with numpy.savez_compressed.") from error
    except ValueError as error:
        hint = "Python objects are not read; store plain arrays." if "pickle" in str(error) else ""
        raise InputError(f"Cannot read an array of {path}: {error}. {hint}".strip()) from error


def _npz_depth(where: str, arrays: dict[str, np.ndarray]) -> Float32[np.ndarray, "h w"]:
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
    return _scaled(f"{where}, key depth", arrays["depth"], scale, "depth_scale")


def _plain(where: str, key: str, array: np.ndarray) -> Any:
    """A Python number or text out of an array with one element."""
    if array.size != 1 or array.dtype.kind not in "iufUb":
        raise InputError(
            f"{where}, key {key}: need one number or text, not {array.dtype} of shape {array.shape}."
        )
    return array.reshape(()).item()


def write_directory(path: Path, frame: Frame, label: Int16[np.ndarray, "h w"]) -> None:
    """Writes a frame with its label image; depth is rounded to 0.1 mm. Raises OSError where it cannot, and
    InputError for depth beyond 6.5 m."""
    o = frame.observation
    if o.depth_m.max() > 65535 * _DEPTH_UNIT_M:
        raise InputError("Depth beyond 6.5 m does not fit depth.png; save this frame as .npz.")
    path.mkdir(parents=True, exist_ok=True)
    pixels = np.where(label >= 0, label, np.where(label == ROBOT, _ROBOT_PIXEL, _BACKGROUND_PIXEL))
    Image.fromarray(o.rgb).save(path / "rgb.png")
    Image.fromarray(np.round(o.depth_m / _DEPTH_UNIT_M).astype(np.uint16)).save(path / "depth.png")
    Image.fromarray(pixels.astype(np.uint8)).save(path / "labels.png")
    grid = frame.grid
    data = {
        "version": 1,
        "K": o.K.tolist(),
        "camera_pose": o.T_world_camera.tolist(),
        "depth_scale_m": _DEPTH_UNIT_M,
        "background": _BACKGROUND_PIXEL,
        "robot": _ROBOT_PIXEL,
        **_written(frame),
        "names": {str(i): name for i, name in frame.names.items()},
        "grid": {
            "origin": grid.origin.tolist(),
            "voxel_size_m": grid.voxel_size_m,
            "shape": list(grid.shape),
        },
    }
    (path / "frame.json").write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")


def write_npz(path: Path, frame: Frame, label: Int16[np.ndarray, "h w"]) -> None:
    """Writes a frame with its label image; names are not kept. Raises OSError where it cannot."""
    o, grid = frame.observation, frame.grid
    arrays: dict[str, Any] = {
        "rgb": o.rgb,
        "depth_m": o.depth_m,
        "K": o.K,
        "T_world_camera": o.T_world_camera,
        "labels": label,
        "background": BACKGROUND,
        "robot": ROBOT,
        **_written(frame),
        "grid_origin": grid.origin,
        "grid_voxel_size_m": grid.voxel_size_m,
        "grid_shape": np.array(grid.shape),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, **arrays)


def _written(frame: Frame) -> dict[str, Any]:
    """The settings that both forms hold."""
    return {
        "target": HIDDEN if frame.target_id is None else frame.target_id,
        "target_description": frame.target_description,
        "support_z_m": frame.support_z_m,
    }
