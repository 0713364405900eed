"""Read the two forms of a stored frame: a directory with rgb.png, depth.png, frame.json and more; a .npz file."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from pydantic import (
    ValidationError,
)

from torc.errors import InputError
from torc.geometry.transforms import Pose, invert
from torc.io.pictures import in_eight_bits, read_pixels
from torc.io.reading import read_json
from torc.io.record_files import read_arrays
from torc.io.strict_yaml import explain_faults
from torc.pipeline.frames.names import UNUSED, our_names, plain_name
from torc.pipeline.frames.plausibility import check_pose
from torc.pipeline.frames.stored import GridSettings, Settings, StoredFrame
from torc.pipeline.frames.values import parse_pose, size_beside
from torc.records import StereoPair

MAX_SIDE_PX, MIN_SIDE_PX = 8192, 16
MAX_PIXELS = 20_000_000
FILES = ("frame.json", "rgb.png", "depth.png")
"""Files of a directory."""
MAYBE = ("labels.png", "left.png", "right.png")
"""Files of a directory that may be missing."""
IMAGES = ("rgb", "labels", "depth_m", "depth", "left", "right")
_PAIR = ("left", "right", "baseline_m")
SETTINGS = (
    "K",
    "T_world_camera",
    "pose_estimated",
    "target",
    "target_description",
    "support_z_m",
    "background",
    "robot",
    "baseline_m",
)
FILE_KEYS: tuple[str, ...] = (*SETTINGS, "depth_scale", "grid_origin", "grid_voxel_size_m", "grid_shape")
_MORE = ("intrinsics", "camera_pose", "depth_scale_m", "names", "grid", "version")
DIRECTORY_KEYS: tuple[str, ...] = (*SETTINGS, *_MORE)
_PICTURES = (*IMAGES, "bgr", "depth_mm")
_CENTRE_AND_FOCUS = ("fx", "fy", "cx", "cy", "ppx", "ppy")
_ALSO_READ = ("depth_scale_m", "T_camera_world", "extrinsics", "depth_factor", *_CENTRE_AND_FOCUS)
_POSES = ("T_world_camera", "T_camera_world", "extrinsics")
_PLAUSIBLE_M = (0.1, 10.0)
"""Range of the median of a depth in metres."""
_LARGEST_UNIT_M = 0.1
_LEAST_BOP_SCALE = 0.02
_INTEGERS = ("uint16", "int16", "uint32", "int32", "uint64", "int64")
_NEEDED = {
    "rgb": (("uint8",), "uint8 (h, w, 3), red first"),
    "depth_m": (
        ("float16", "float32", "float64"),
        "floats (h, w) in metres; integers are depth, with depth_scale",
    ),
    "depth": (_INTEGERS, "integers of 16 bits or more, shape (h, w)"),
    "labels": (
        ("uint8", "int8", *_INTEGERS),
        "integers of shape (h, w), one instance number per pixel; a color-coded picture has to be turned into numbers",
    ),
    "left": (("uint8",), "grey pictures, uint8 (h, w)"),
    "right": (("uint8",), "grey pictures, uint8 (h, w)"),
}
"""Allowed pixel types, and the message for others."""


_Images = dict[str, tuple[str, np.ndarray]]
"""Pictures by our names, each with its place for messages."""


def read_frame(path: Path) -> StoredFrame:
    """Read the frame in a .npz file or directory. Raises InputError, naming file and key, if it cannot be read."""
    files = [path / name for name in (*FILES, *MAYBE)] if path.is_dir() else [path]
    files = [file for file in files if file.name not in MAYBE or file.exists()]
    for file in files:
        if not file.exists():
            what = f"{path} lacks {file.name}" if path.is_dir() else f"There is no frame '{path}'"
            raise InputError(f"{what}. Give a .npz file, or a directory with {', '.join(FILES)}.")
        if not file.is_file():  # reading a pipe would never return
            raise InputError(f"{file} is no regular file. Store the frame in one, and give that.")
    if path.is_dir():
        where = str(path / "frame.json")
        data = read_json(path / "frame.json")
        names = our_names(where, data, (*DIRECTORY_KEYS, *_ALSO_READ))
        images = {file.stem: (str(file), read_pixels(file)) for file in files if file.suffix == ".png"}
    elif path.suffix == ".npz":
        where, arrays = str(path), read_arrays(path)
        names = our_names(where, arrays, (*_PICTURES, *FILE_KEYS, *_ALSO_READ))
        images = {ours: (f"{path}, key {k}", arrays.pop(k)) for k, ours in names.items() if ours in _PICTURES}
        data = {k: a.item() if a.size == 1 else a.tolist() for k, a in arrays.items()}
    else:
        raise InputError(f"'{path}' is neither a .npz file nor a directory with {', '.join(FILES)}.")
    notes = [
        f"'{k}' is not read. Call it labels if these are the masks to use." for k in data if k == "truth"
    ]
    return _stored(where, images, {k: v for k, v in data.items() if k not in UNUSED}, names, notes)


def _stored(
    where: str, images: _Images, data: Mapping[str, Any], names: Mapping[str, str], notes: list[str]
) -> StoredFrame:
    """Build a frame from pictures and values under foreign names."""
    theirs = {ours: k for k, ours in names.items()}
    values = {names[k]: v for k, v in data.items()}
    if grid := {k: values.pop(f"grid_{k}") for k in GridSettings.model_fields if f"grid_{k}" in values}:
        values["grid"] = grid
    if apart := {k: values.pop(k) for k in _CENTRE_AND_FOCUS if k in values}:
        if "K" in values:
            raise InputError(f"{where}: {theirs['K']} and {', '.join(apart)} both give intrinsics. Keep one.")
        values["K"] = apart
    if len(poses := [theirs[k] for k in _POSES if k in values]) > 1:
        raise InputError(
            f"{where}: keys {' and '.join(poses)} both give the camera's pose. Keep one of them."
        )
    open_pose = None
    if "extrinsics" in values:
        open_pose = _pose(where, theirs["extrinsics"], values.pop("extrinsics"))
    if "T_camera_world" in values:
        values["T_world_camera"] = invert(
            _pose(where, theirs["T_camera_world"], values.pop("T_camera_world"))
        )
    _settle_depth_unit(where, values, theirs, notes)
    images = _our_pictures(where, images, values)
    try:
        size = size_beside(values.get("K"))
        settings = Settings.model_validate(values)
    except ValidationError as error:
        lines = [line.strip() for line in explain_faults(error).splitlines()]
        faults = [f"key {_named(line, theirs)}" for line in lines]
        raise InputError(f"{where}, {'; '.join(faults)}.") from None
    except ValueError as error:
        raise InputError(f"{where}, key {theirs.get('K', 'K')}: {error}.") from None
    stored = _checked(where, images, settings)
    height, width = stored.depth_m.shape
    if size not in (None, (width, height)):
        raise InputError(
            f"{where}, key {theirs.get('K', 'K')}: these intrinsics are of {size[0]}x{size[1]} pixels, the pictures "
            f"have {width}x{height}. Scale fx, fy, cx and cy with the picture, or take those of its size."
        )
    return replace(
        stored, open_pose=open_pose, open_pose_key=theirs.get("extrinsics", "extrinsics"), notes=tuple(notes)
    )


def _named(fault: str, theirs: Mapping[str, str]) -> str:
    """Return a fault under the file's own key."""
    field, rest = fault.split(":", 1) if ":" in fault else (fault, "")
    return f"{theirs.get(field, field)}:{rest}"


def _pose(where: str, key: str, given: Any) -> Pose:
    try:
        pose = parse_pose(given)
    except ValueError as error:
        raise InputError(f"{where}, key {key}: {error}.") from None
    check_pose(f"{where}, key {key}", pose)
    return pose


def _settle_depth_unit(
    where: str, values: dict[str, Any], theirs: Mapping[str, str], notes: list[str]
) -> None:
    """Convert units per metre, and BOP's millimetres per unit, to metres per unit."""
    if "depth_factor" in values:
        factor = values.pop("depth_factor")
        if "depth_scale_m" in values or "depth_scale" in values:
            raise InputError(
                f"{where}: {theirs['depth_factor']} and the depth's scale say the same. Keep one."
            )
        if isinstance(factor, bool) or not isinstance(factor, int | float) or not 10 <= factor <= 1e6:
            raise InputError(
                f"{where}, key {theirs['depth_factor']}: {factor!r} is no number of units per metre."
            )
        values["depth_scale_m"] = 1 / factor
    scale = values.get("depth_scale_m")
    bop = plain_name(theirs.get("K", "")) == "camk"
    if bop and isinstance(scale, int | float) and _LEAST_BOP_SCALE <= scale <= 10:
        values["depth_scale_m"] = scale / 1000
        notes.append(f"The depth's scale, {scale:g}, beside cam_K is read as BOP's: millimetres per unit.")


def _our_pictures(where: str, images: _Images, values: dict[str, Any]) -> _Images:
    """Return the pictures in the forms that torc works with. `values` gets the depth unit that a name states."""
    images = dict(images)
    _one_of(where, images, "rgb", "bgr")
    _one_of(where, images, "depth_m", "depth", "depth_mm")
    if "bgr" in images:
        place, picture = images.pop("bgr")
        images["rgb"] = place, as_rgb(picture)[..., ::-1]
    if "rgb" in images:
        place, picture = images["rgb"]
        images["rgb"] = place, as_rgb(picture)
    if "depth_mm" in images:
        if "depth_scale_m" in values:
            raise InputError(f"{where}: depth_mm has its unit in its name. Leave the depth's scale out.")
        values["depth_scale_m"] = 0.001
        place, depth = images.pop("depth_mm")
        floats = np.issubdtype(depth.dtype, np.floating)
        images["depth_m" if floats else "depth"] = place, depth * np.float32(0.001) if floats else depth
    for name in {"depth", "depth_m"} & set(images):
        images[name] = images[name][0], as_plane(images[name][1])
    if "depth" in images and np.issubdtype(images["depth"][1].dtype, np.floating):
        place, depth = images.pop("depth")
        images["depth_m"] = place, depth * _scale_of_floats(place, depth, values.get("depth_scale_m"))
    if "labels" in images:
        place, labels = images["labels"]
        images["labels"] = place, as_labels(labels)
    return images


def _one_of(where: str, images: _Images, *names: str) -> None:
    if len(several := [k for k in names if k in images]) > 1:
        raise InputError(f"{where}: {' and '.join(several)} say the same. Keep one of them.")


def _scale_of_floats(place: str, depth: np.ndarray, scale: Any) -> np.float32:
    """Return the factor to metres for floats: 1, unless only the given scale yields a distance that a camera sees."""
    read = depth[np.isfinite(depth) & (depth > 0)]
    if not isinstance(scale, int | float) or scale == 1 or read.size == 0:
        return np.float32(1)
    low, high = _PLAUSIBLE_M
    fit = [s for s in (1.0, float(scale)) if low < s * float(np.median(read)) < high]
    if len(fit) != 1:
        raise InputError(
            f"{place}: these are floats, and a scale is given, too. Store metres as depth_m and leave the scale out, "
            "or integers with the scale."
        )
    return np.float32(fit[0])


def _checked(where: str, images: Mapping[str, tuple[str, np.ndarray]], settings: Settings) -> StoredFrame:
    """Check these images, each with its place for messages, and build the frame."""
    depth = "depth_m" if "depth_m" in images else "depth"
    if missing := [k for k in ("rgb", depth) if k not in images]:
        forms = "; that is depth_m (floats, metres), or depth (integers) with depth_scale"
        more = forms if depth in missing else ""
        raise InputError(f"{where} lacks {', '.join(missing)}{more}.")
    shapes = {}
    for key in [k for k in ("rgb", depth, "labels", "left", "right") if k in images]:
        place, image = images[key]
        types, need = _NEEDED[key]
        channels = (3,) if key == "rgb" else ()
        if image.ndim < 2 or image.shape[2:] != channels or image.dtype.name not in types:
            raise InputError(f"{place}: {image.dtype} {image.shape}; need {need}.")
        h, w = image.shape[:2]
        if min(h, w) < MIN_SIDE_PX or max(h, w) > MAX_SIDE_PX or h * w > MAX_PIXELS:
            raise InputError(
                f"{place} is {w}x{h} pixels; sides must be {MIN_SIDE_PX}..{MAX_SIDE_PX} and at most "
                f"{MAX_PIXELS // 10**6} megapixels in all. Scale the images and K."
            )
        shapes[key] = f"{key} {w}x{h}"
    if len({images[key][1].shape[:2] for key in shapes}) > 1:
        sizes = ", ".join(shapes.values())
        raise InputError(f"{where}: image sizes differ ({sizes}). Register all of them to one camera.")
    rgb, depth_image = images["rgb"][1], images[depth][1]
    labels = images["labels"][1].astype(np.int64) if "labels" in images else None
    depth_m = (depth_image * (1.0 if depth == "depth_m" else settings.depth_scale_m)).astype(np.float32)
    return StoredFrame(where, rgb, depth_m, labels, settings, _pair(where, images, settings))


def _pair(where: str, images: Mapping[str, tuple[str, np.ndarray]], settings: Settings) -> StereoPair | None:
    """Return the stereo pair, if the frame has one. Raises InputError if it is incomplete."""
    missing = [k for k in _PAIR if k not in images and getattr(settings, k, None) is None]
    if missing and len(missing) < len(_PAIR):
        raise InputError(f"{where} holds a part of a stereo pair: it lacks {', '.join(missing)}.")
    if missing:
        return None
    return StereoPair(images["left"][1], images["right"][1], float(settings.baseline_m or 0.0))


_MOST_INSTANCES = 1000


def as_rgb(image: np.ndarray) -> UInt8[np.ndarray, "h w 3"] | np.ndarray:
    """Convert a colour picture of any bit depth, with or without alpha, channels first or last, to 8-bit RGB.

    Anything else is returned unchanged.
    """
    if image.ndim == 3 and image.shape[0] in (3, 4) and image.shape[2] not in (3, 4):
        image = np.moveaxis(image, 0, -1)
    if image.ndim != 3 or image.shape[2] not in (3, 4):
        return image
    return np.ascontiguousarray(in_eight_bits(image)[..., :3])


def as_plane(image: np.ndarray) -> np.ndarray:
    """Remove axes of length one from depth or labels."""
    return np.squeeze(image) if image.ndim > 2 and np.squeeze(image).ndim == 2 else image


def as_labels(image: np.ndarray) -> np.ndarray:
    """Convert labels to whole numbers per pixel.

    Accepts whole floats, one mask (1 inside), and a stack of masks (1 for the first one, and so on; later ones cover
    earlier ones). Anything else is returned unchanged.
    """
    image = as_plane(image)
    if image.ndim == 3 and (image.dtype == bool or (image.shape[2] != 3 and np.isin(image, (0, 1)).all())):
        first = image if image.shape[0] < image.shape[2] else np.moveaxis(image, -1, 0)
        if len(first) > _MOST_INSTANCES:
            return image
        stacked = np.zeros(first.shape[1:], np.int16)
        for number, mask in enumerate(first, start=1):
            stacked[mask.astype(bool)] = number
        return stacked
    if image.dtype == bool:
        return image.astype(np.int16)
    if np.issubdtype(image.dtype, np.floating) and np.isfinite(image).all():
        whole = np.round(image)
        if (whole == image).all() and np.abs(image).max(initial=0) < 2**31:
            return whole.astype(np.int64)
    return image
