"""Frames as one .npz file."""

import difflib
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, Int16

from torc.errors import InputError
from torc.pipeline.frames.record import HIDDEN, SETTINGS, Frame, RawFrame
from torc.pipeline.frames.values import as_color, as_labels, as_matrix, scaled_depth
from torc.records import BACKGROUND, ROBOT

MAX_ARRAY_BYTES = 512 * 2**20
_REQUIRED_ARRAYS = ("rgb", "K", "T_world_camera", "labels")
_GRID_KEYS = ("grid_origin", "grid_voxel_size_m", "grid_shape")
_OPTIONAL = ("depth_m", "depth", "depth_scale", *SETTINGS, *_GRID_KEYS)


def read_npz(path: Path) -> RawFrame:
    """The frame in a .npz file. Raises InputError, naming file and key, where there is none."""
    arrays = _npz_arrays(path)
    where = str(path)
    missing = [k for k in _REQUIRED_ARRAYS if k not in arrays]
    if missing:
        raise InputError(
            f"{where} lacks {', '.join(missing)}; it holds {', '.join(sorted(arrays)) or 'nothing'}."
        )
    _refuse_misspelt(where, arrays)
    settings = {k: _plain(where, k, arrays[k]) for k in SETTINGS if k in arrays}
    if any(k in arrays for k in _GRID_KEYS):
        if not all(k in arrays for k in _GRID_KEYS):
            raise InputError(f"{where}: a grid needs all of {', '.join(_GRID_KEYS)}.")
        origin, size, shape = (arrays[k].tolist() for k in _GRID_KEYS)
        settings["grid"] = {"origin": origin, "voxel_size_m": size, "shape": shape}
    return RawFrame(
        where,
        as_color(f"{where}, key rgb", arrays["rgb"]),
        _npz_depth(where, arrays),
        as_labels(f"{where}, key labels", arrays["labels"]),
        as_matrix(f"{where}, key K", arrays["K"], (3, 3)),
        as_matrix(f"{where}, key T_world_camera", arrays["T_world_camera"], (4, 4)),
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


def _refuse_misspelt(where: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Other arrays may be there too, but not ones that were clearly meant to be an optional one."""
    absent = [k for k in _OPTIONAL if k not in arrays]
    for key in sorted(set(arrays) - {*_REQUIRED_ARRAYS, *_OPTIONAL}):
        near = difflib.get_close_matches(key, absent, n=1, cutoff=0.85)
        if near:
            raise InputError(f"{where}: unknown key '{key}'. Did you mean '{near[0]}'?")


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
    return scaled_depth(f"{where}, key depth", arrays["depth"], scale, "depth_scale")


def _plain(where: str, key: str, array: np.ndarray) -> Any:
    """A Python number or text out of an array with one element."""
    if array.size != 1 or array.dtype.kind not in "iufUb":
        raise InputError(
            f"{where}, key {key}: need one number or text, not {array.dtype} of shape {array.shape}."
        )
    return array.reshape(()).item()


def write_npz(path: Path, frame: Frame, label: Int16[np.ndarray, "h w"]) -> None:
    """Writes a frame with its label image; names are not kept. Raises OSError where it cannot."""
    o = frame.observation
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        rgb=o.rgb,
        depth_m=o.depth_m,
        K=o.K,
        T_world_camera=o.T_world_camera,
        labels=label,
        background=BACKGROUND,
        robot=ROBOT,
        target=HIDDEN if frame.target_id is None else frame.target_id,
        target_description=frame.target_description,
        support_z_m=frame.support_z_m,
        grid_origin=frame.grid.origin,
        grid_voxel_size_m=frame.grid.voxel_size_m,
        grid_shape=np.array(frame.grid.shape),
    )
