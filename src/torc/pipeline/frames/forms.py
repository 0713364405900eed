"""Read the two forms of a stored frame: a directory with rgb.png, depth.png, frame.json and more; a .npz file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float32, Int64, UInt8
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    StrictBool,
    StrictInt,
    ValidationError,
    model_validator,
)

from torc.errors import InputError
from torc.geometry.transforms import invert
from torc.io.pictures import in_eight_bits, read_pixels
from torc.io.reading import read_json
from torc.io.record_files import read_arrays
from torc.io.strict_yaml import Number, explain_faults
from torc.pipeline.frames.against_picture import direction_of
from torc.pipeline.frames.names import UNUSED, our_names, plain_name
from torc.pipeline.frames.plausibility import check_intrinsics, check_pose, clean_depth
from torc.pipeline.frames.values import parse_intrinsics, parse_pose, size_beside
from torc.records import ROBOT, Observation, StereoPair

MAX_SIDE_PX, MIN_SIDE_PX = 8192, 16
MAX_PIXELS = 20_000_000
_MAX_TEXT = 500
_MAX_VOXELS = 20e6
_LARGEST_UNIT_M = 0.1
_MOST_INSTANCES = 1000
FILES = ("frame.json", "rgb.png", "depth.png")
"""Files of a directory."""
MAYBE = ("labels.png", "left.png", "right.png")
"""Files of a directory that may be missing."""
IMAGES = ("rgb", "labels", "depth_m", "depth", "left", "right")
_PICTURES = (*IMAGES, "bgr", "depth_mm")
_PAIR = ("left", "right", "baseline_m")
_CENTRE_AND_FOCUS = ("fx", "fy", "cx", "cy", "ppx", "ppy")
_POSES = ("T_world_camera", "T_camera_world", "extrinsics")
_PLAUSIBLE_M = (0.1, 10.0)
"""Range of the median of a depth in metres."""
_LEAST_BOP_SCALE = 0.02
_INTEGERS = ("uint16", "int16", "uint32", "int32", "uint64", "int64")
_GREY = (("uint8",), "grey pictures, uint8 (h, w)")
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
    "left": _GREY,
    "right": _GREY,
}
"""Allowed pixel types, and the message for others."""


class GridSettings(BaseModel):
    """A voxel grid from a file."""

    model_config = ConfigDict(extra="forbid")
    origin: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    voxel_size_m: Number = Field(ge=0.001, le=0.1)
    shape: tuple[int, int, int]

    @model_validator(mode="after")
    def _not_too_large(self) -> "GridSettings":
        if not all(1 <= n <= 1000 for n in self.shape) or np.prod(self.shape) > _MAX_VOXELS:
            raise ValueError(f"shape is {self.shape}; need 1..1000 a side, 20 million in all")
        return self


def _depth_unit(metres: float) -> float:
    """Return metres per unit of depth. Raises ValueError if implausible."""
    if 1e-6 <= metres <= _LARGEST_UNIT_M:
        return metres
    turned = f" {metres:g} looks like units per metre: give {1 / metres:g}" if metres >= 100 else ""
    raise ValueError(
        f"is metres per unit, 0.001 for millimetres; it must be 1e-06 to {_LARGEST_UNIT_M}.{turned}"
    )


class Settings(BaseModel):
    """Everything that a frame holds beside its images."""

    model_config = ConfigDict(extra="forbid")
    K: Annotated[Any, BeforeValidator(parse_intrinsics)]
    T_world_camera: Annotated[Any, BeforeValidator(parse_pose)] = None
    pose_estimated: StrictBool = False
    depth_scale_m: Annotated[Number, AfterValidator(_depth_unit)] = 0.001
    target: StrictInt | str | None = None
    target_description: str = Field("", max_length=_MAX_TEXT)
    support_z_m: Annotated[Number, Field(allow_inf_nan=False)] | None = None
    background: StrictInt | None = None
    robot: StrictInt = ROBOT
    baseline_m: Annotated[Number, Field(gt=0.0, le=10.0)] | None = None
    grid: GridSettings | None = None
    names: dict[int, Annotated[str, BeforeValidator(lambda name: str(name)[:_MAX_TEXT])]] = {}
    version: Literal[1] = 1


KEYS: tuple[str, ...] = (
    *Settings.model_fields,
    "depth_scale",
    *(f"grid_{k}" for k in GridSettings.model_fields),
)
"""Keys of a frame beside its images. Further ones are only read."""
_ALSO_READ = ("T_camera_world", "extrinsics", "depth_factor", *_CENTRE_AND_FOCUS)


@dataclass(frozen=True)
class StoredFrame:
    """A frame as it was stored in the file `where`, checked.

    Attributes:
        depth_m: 0 where there is no reading.
        labels: in the file's own numbers; None without masks.
        pair: what a stereo camera saw, if it is stored too.
        notes: how the file was understood.
    """

    where: str
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    labels: Int64[np.ndarray, "h w"] | None
    settings: Settings
    pair: StereoPair | None = None
    notes: tuple[str, ...] = ()


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
        names = our_names(where, data, (*KEYS, *_ALSO_READ))
        images = {file.stem: (str(file), read_pixels(file)) for file in files if file.suffix == ".png"}
    elif path.suffix == ".npz":
        where, arrays = str(path), read_arrays(path)
        names = our_names(where, arrays, (*_PICTURES, *KEYS, *_ALSO_READ))
        images = {ours: (f"{path}, key {k}", arrays.pop(k)) for k, ours in names.items() if ours in _PICTURES}
        data = {k: a.item() if a.size == 1 else a.tolist() for k, a in arrays.items()}
    else:
        raise InputError(f"'{path}' is neither a .npz file nor a directory with {', '.join(FILES)}.")
    notes = ["'truth' is not read. Call it labels if these are the masks to use."] if "truth" in data else []
    values = {names[k]: v for k, v in data.items() if k not in UNUSED}
    return _stored(where, images, values, {ours: k for k, ours in names.items()}, notes)


def _stored(
    where: str, images: _Images, values: dict[str, Any], theirs: dict[str, str], notes: list[str]
) -> StoredFrame:
    """Build a frame from pictures and values; `theirs` has the file's own names of the keys."""
    if grid := {k: values.pop(f"grid_{k}") for k in GridSettings.model_fields if f"grid_{k}" in values}:
        values["grid"] = grid
    if apart := [k for k in _CENTRE_AND_FOCUS if k in values]:
        _one_of(where, [theirs[k] for k in ("K", apart[0]) if k in values])
        values["K"] = {k: values.pop(k) for k in apart}
    poses = [k for k in _POSES if k in values]
    _one_of(where, [theirs[k] for k in poses])
    for pose in poses:
        values["T_world_camera"], theirs["T_world_camera"] = values.pop(pose), theirs[pose]
    _settle_depth_unit(where, values, theirs, notes)
    images = _our_pictures(where, images, values)
    try:
        size = size_beside(values.get("K"))
        settings = Settings.model_validate(values)
    except ValidationError as error:
        faults = []
        for line in explain_faults(error).splitlines():
            key, _, fault = line.strip().partition(":")
            faults.append(f"key {theirs.get(key, key)}:{fault}")
        raise InputError(f"{where}, {'; '.join(faults)}.") from None
    except ValueError as error:
        raise InputError(f"{where}, key {theirs.get('K', 'K')}: {error}.") from None
    rgb, depth_m, labels = _checked(where, images, settings)
    height, width = depth_m.shape
    if size not in (None, (width, height)):
        raise InputError(
            f"{where}, key {theirs.get('K', 'K')}: these intrinsics are of {size[0]}x{size[1]} pixels, the pictures "
            f"have {width}x{height}. Scale fx, fy, cx and cy with the picture, or take those of its size."
        )
    check_intrinsics(where, settings.K, depth_m.shape)
    if poses:
        T, key = settings.T_world_camera, theirs["T_world_camera"]
        check_pose(f"{where}, key {key}", T)
        if poses == ["extrinsics"]:
            bare = Observation(rgb, depth_m, settings.K, np.eye(4), np.zeros(0), 0.0)
            T, note = direction_of(where, key, T, bare)
            notes.append(note)
        T = invert(T) if poses == ["T_camera_world"] else T
        settings = settings.model_copy(update={"T_world_camera": T})
    return StoredFrame(where, rgb, depth_m, labels, settings, _pair(where, images, settings), tuple(notes))


def _one_of(where: str, given: list[str]) -> None:
    """Raise InputError if more than one of several keys that say the same is given."""
    if len(given) > 1:
        raise InputError(f"{where}: {' and '.join(given)} say the same. Keep one of them.")


def _settle_depth_unit(where: str, values: dict[str, Any], theirs: dict[str, str], notes: list[str]) -> None:
    """Convert units per metre, and BOP's millimetres per unit, to metres per unit."""
    if "depth_factor" in values:
        _one_of(where, [theirs[k] for k in ("depth_factor", "depth_scale_m") if k in values])
        factor, theirs["depth_scale_m"] = values.pop("depth_factor"), theirs["depth_factor"]
        if isinstance(factor, bool) or not isinstance(factor, int | float) or not 10 <= factor <= 1e6:
            raise InputError(
                f"{where}, key {theirs['depth_factor']}: {factor!r} is not a number of units per metre."
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
    for names in (("rgb", "bgr"), ("depth_m", "depth", "depth_mm")):
        _one_of(where, [k for k in names if k in images])
    for name in {"rgb", "bgr"} & set(images):
        place, picture = images.pop(name)
        images["rgb"] = place, as_rgb(picture)[..., ::-1] if name == "bgr" else as_rgb(picture)
    if "depth_mm" in images:
        _one_of(where, ["depth_mm", *(k for k in values if k == "depth_scale_m")])
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
        images["labels"] = images["labels"][0], as_labels(images["labels"][1])
    return images


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


def _checked(
    where: str, images: _Images, settings: Settings
) -> tuple[UInt8[np.ndarray, "h w 3"], Float32[np.ndarray, "h w"], Int64[np.ndarray, "h w"] | None]:
    """Check these images; return colour, depth in metres, and labels if there are any."""
    depth = "depth_m" if "depth_m" in images else "depth"
    if missing := [k for k in ("rgb", depth) if k not in images]:
        raise InputError(
            f"{where} lacks {', '.join(missing)}. It needs rgb, and depth_m (floats, metres), or depth (integers) with "
            "depth_scale."
        )
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
        shapes[key] = f"{w}x{h}"
    if len({*shapes.values()}) > 1:
        sizes = ", ".join(f"{key} {size}" for key, size in shapes.items())
        raise InputError(f"{where}: image sizes differ ({sizes}). Register all of them to one camera.")
    labels = images["labels"][1].astype(np.int64) if "labels" in images else None
    depth_m = (images[depth][1] * (1.0 if depth == "depth_m" else settings.depth_scale_m)).astype(np.float32)
    return images["rgb"][1], clean_depth(where, depth_m), labels


def _pair(where: str, images: _Images, settings: Settings) -> StereoPair | None:
    """Return the stereo pair, if the frame has one. Raises InputError if it is incomplete."""
    missing = [k for k in _PAIR if k not in images and getattr(settings, k, None) is None]
    if missing and len(missing) < len(_PAIR):
        raise InputError(f"{where} holds a part of a stereo pair: it lacks {', '.join(missing)}.")
    if missing:
        return None
    return StereoPair(images["left"][1], images["right"][1], float(settings.baseline_m or 0.0))


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
