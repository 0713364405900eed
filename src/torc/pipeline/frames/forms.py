"""The two forms of a stored frame: a directory with rgb.png, depth.png, frame.json and more; a .npz file."""

import difflib
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float32, Int64, UInt8
from PIL import Image
from pydantic import (
    AliasChoices,
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
from torc.files.strict_yaml import Number, explain_faults
from torc.geometry.transforms import make_pose, rotation_from_wxyz
from torc.records import ROBOT, Observation, StereoPair, VoxelGrid

HIDDEN = "hidden"
"""What `target` says while the target is not in sight."""
MAX_SIDE_PX, MIN_SIDE_PX = 8192, 16
MAX_PIXELS = 20_000_000
MAX_ARRAY_BYTES = 512 * 2**20
_MAX_TEXT = 500
_MAX_VOXELS = 20e6
FILES = ("frame.json", "rgb.png", "depth.png")
"""Of a directory."""
MAYBE = ("labels.png", "left.png", "right.png")
"""Of a directory; may be missing."""
IMAGES = ("rgb", "labels", "depth_m", "depth", "left", "right")
_PAIR = ("left", "right", "baseline_m")
SETTINGS = (
    *("K", "T_world_camera", "pose_estimated", "target", "target_description"),
    *("support_z_m", "background", "robot", "baseline_m"),
)
FILE_KEYS: tuple[str, ...] = (*SETTINGS, "depth_scale", "grid_origin", "grid_voxel_size_m", "grid_shape")
_MORE = ("intrinsics", "camera_pose", "depth_scale_m", "names", "grid", "version")
DIRECTORY_KEYS: tuple[str, ...] = (*SETTINGS, *_MORE)
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
"""Types of the pixels, and what to say of others."""


def _finite(value: Any, *shape: int) -> np.ndarray:
    """Finite numbers of that shape. Raises ValueError."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"need {'x'.join(map(str, shape))} finite numbers, not {str(value)[:120]}")
    return array


def _intrinsics(given: Any) -> np.ndarray:
    """A matrix, or fx, fy, cx, cy in pixels."""
    if not isinstance(given, dict):
        return _finite(given, 3, 3)
    fx, fy, cx, cy = _finite([given.get(k) for k in ("fx", "fy", "cx", "cy")], 4)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def parse_pose(given: Any) -> np.ndarray:
    """A camera pose: a matrix (4, 4), or position and unit quaternion. Raises ValueError for what is none."""
    if not isinstance(given, dict):
        return _finite(given, 4, 4)
    if not {"position", "wxyz"} <= set(given):
        raise ValueError("need position (3) and wxyz (4), or a 4x4 matrix")
    wxyz = _finite(given["wxyz"], 4)
    if abs(np.linalg.norm(wxyz) - 1) > 1e-2:
        raise ValueError(f"{wxyz.tolist()} is no unit quaternion (w first)")
    return make_pose(rotation_from_wxyz(wxyz), _finite(given["position"], 3))


class GridSettings(BaseModel):
    """A voxel grid out of a file."""

    model_config = ConfigDict(extra="forbid")
    origin: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    voxel_size_m: Number = Field(ge=0.001, le=0.1)
    shape: tuple[int, int, int]

    @model_validator(mode="after")
    def _not_too_large(self) -> "GridSettings":
        if not all(1 <= n <= 1000 for n in self.shape) or np.prod(self.shape) > _MAX_VOXELS:
            raise ValueError(f"shape is {self.shape}; need 1..1000 a side, 20 million in all")
        return self


class Settings(BaseModel):
    """All that a frame holds beside its images."""

    model_config = ConfigDict(extra="forbid")
    K: Annotated[Any, BeforeValidator(_intrinsics)] = Field(validation_alias=AliasChoices("K", "intrinsics"))
    T_world_camera: Annotated[Any, BeforeValidator(parse_pose)] = Field(
        None, validation_alias=AliasChoices("T_world_camera", "camera_pose")
    )
    pose_estimated: StrictBool = False
    depth_scale_m: Number = Field(
        0.001, ge=1e-6, le=0.1, validation_alias=AliasChoices("depth_scale_m", "depth_scale")
    )
    target: StrictInt | str | None = None
    target_description: str = Field("", max_length=_MAX_TEXT)
    support_z_m: Annotated[Number, Field(allow_inf_nan=False)] | None = None
    background: StrictInt | None = None
    robot: StrictInt = ROBOT
    baseline_m: Annotated[Number, Field(gt=0.0, le=10.0)] | None = None
    grid: GridSettings | None = None
    names: dict[int, Annotated[str, BeforeValidator(lambda name: str(name)[:_MAX_TEXT])]] = {}
    version: Literal[1] = 1


@dataclass(frozen=True)
class Frame:
    """One frame, ready for the pipeline: its label image holds object ids 0..63, the target being 0. Without masks it
    has none, and a perception has to find the objects.

    Attributes:
        target_id: TARGET_ID, or None while the target is hidden, or not known.
        support_z_m: height of the surface that the objects stand on.
        grid: region of the occlusion volume.
        labels, names: label in the file per object id, and name, where the file has one.
    """

    observation: Observation
    target_id: int | None
    target_description: str
    support_z_m: float
    grid: VoxelGrid
    labels: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    support_estimated: bool = False

    @property
    def pose_estimated(self) -> bool:
        """Whether the camera's pose was made up from the picture: then no robot knows the world of this frame."""
        return self.observation.pose_estimated


@dataclass(frozen=True)
class StoredFrame:
    """A frame as it was stored in the file `where`: depth with NaN, infinity or 0 where there is no reading, and labels
    in the file's own numbers; None without masks. `pair` is what a stereo camera saw, if it is stored too.
    """

    where: str
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    labels: Int64[np.ndarray, "h w"] | None
    settings: Settings
    pair: StereoPair | None = None


def read_frame(path: Path) -> StoredFrame:
    """The frame at a .npz file or directory. Raises InputError, naming file and key, where it cannot be read."""
    files = [path / name for name in (*FILES, *MAYBE)] if path.is_dir() else [path]
    files = [file for file in files if file.name not in MAYBE or file.exists()]
    for file in files:
        if not file.exists():
            what = f"{path} lacks {file.name}" if path.is_dir() else f"There is no frame '{path}'"
            raise InputError(f"{what}. Give a .npz file, or a directory with {', '.join(FILES)}.")
        if not file.is_file():  # reading a pipe would wait for ever
            raise InputError(f"{file} is no regular file. Store the frame in one, and give that.")
    if path.is_dir():
        where, known = str(path / "frame.json"), DIRECTORY_KEYS
        data = _json(path / "frame.json")
        images = {file.stem: (str(file), _pixels(file)) for file in files if file.suffix == ".png"}
    elif path.suffix == ".npz":
        where, known = str(path), FILE_KEYS
        arrays = _arrays(path)
        images = {k: (f"{path}, key {k}", arrays.pop(k)) for k in IMAGES if k in arrays}
        data = {k: a.item() if a.size == 1 else a.tolist() for k, a in arrays.items()}
        if grid := {k: data.pop(f"grid_{k}") for k in GridSettings.model_fields if f"grid_{k}" in data}:
            data["grid"] = grid
    else:
        raise InputError(f"'{path}' is neither a .npz file nor a directory with {', '.join(FILES)}.")
    absent = [k for k in known if k not in data]
    for key in sorted(set(data) - {*known, "grid"}):
        if near := difflib.get_close_matches(key, absent, n=1, cutoff=0.85):
            raise InputError(f"{where}: unknown key '{key}'. Did you mean '{near[0]}'?")
        if known is FILE_KEYS:
            del data[key]
    try:
        settings = Settings.model_validate(data)
    except ValidationError as error:
        faults = [f"key {line.strip()}" for line in explain_faults(error).splitlines()]
        raise InputError(f"{where}, {'; '.join(faults)}.") from None
    return _checked(where, images, settings)


def _checked(where: str, images: Mapping[str, tuple[str, np.ndarray]], settings: Settings) -> StoredFrame:
    """The frame of these images, each with its place for messages."""
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
    """The stereo pair, if the frame has one. Raises InputError for a part of one."""
    missing = [k for k in _PAIR if k not in images and getattr(settings, k, None) is None]
    if missing and len(missing) < len(_PAIR):
        raise InputError(f"{where} holds a part of a stereo pair: it lacks {', '.join(missing)}.")
    if missing:
        return None
    return StereoPair(images["left"][1], images["right"][1], float(settings.baseline_m or 0.0))


def _json(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"Cannot read {path}: {error}.") from error
    if not isinstance(data, dict):
        raise InputError(f"{path} must hold a JSON object, not a {type(data).__name__}.")
    return data


def _pixels(path: Path) -> np.ndarray:
    """Of a picture: rgb.png in color, the others as they are."""
    try:
        with Image.open(path) as image:
            if image.width * image.height > MAX_PIXELS:
                raise ValueError(f"{image.width}x{image.height} pixels are too many")
            return np.array(image.convert("RGB") if path.name == "rgb.png" else image)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"Cannot read the image {path}: {error}.") from error


def _arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        with zipfile.ZipFile(path) as archive:
            if max((member.file_size for member in archive.infolist()), default=0) > MAX_ARRAY_BYTES:
                raise InputError(f"{path} holds an array larger than {MAX_ARRAY_BYTES // 2**20} MB unpacked.")
        with np.load(path, allow_pickle=False) as data:
            return dict(data)
    except (OSError, zipfile.BadZipFile, EOFError, MemoryError, ValueError) as error:
        hint = "Python objects are not read; store plain arrays" if "pickle" in str(error) else str(error)
        raise InputError(f"Cannot read {path}: {hint}. Write it with numpy.savez_compressed.") from error
