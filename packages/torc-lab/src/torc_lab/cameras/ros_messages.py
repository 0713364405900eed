"""sensor_msgs/Image, CompressedImage and CameraInfo as rosbridge gives them, in the forms of ROS 1 and of ROS 2."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8
from pydantic import AliasChoices, Base64Bytes, BaseModel, ConfigDict, Field, ValidationError

from torc import InputError
from torc.io.strict_yaml import explain_faults
from torc_lab.cameras.lens import PinholeMap, pinhole_map

_PIXELS: Mapping[str, tuple[str, int]] = {
    "rgb8": ("u1", 3),
    "bgr8": ("u1", 3),
    "rgba8": ("u1", 4),
    "bgra8": ("u1", 4),
    "mono8": ("u1", 1),
    "mono16": ("u2", 1),
    "16UC1": ("u2", 1),
    "32FC1": ("f4", 1),
}
"""Type and number of channels, by encoding."""
_MODELS = ("", "plumb_bob", "rational_polynomial")
_MOST_SIDE_PX = 8192
_DEPTH_HEADER = struct.Struct("<iff")
"""In front of the PNG of compressed depth: a format number, then the two parameters of quantized metres."""


@dataclass(frozen=True)
class RosImage:
    """A picture: `pixels` are (h, w, 3 or 4) uint8, or (h, w) uint8, uint16 or float32."""

    topic: str
    encoding: str
    pixels: np.ndarray
    stamp_s: float
    frame_id: str

    def colors(self) -> UInt8[np.ndarray, "h w 3"]:
        """Red first; grey pictures as three equal channels, those of 16 bits scaled to their brightest pixel. Raises
        InputError for a picture of depth.
        """
        if self.encoding.startswith("mono"):
            brightest = 255 if self.encoding == "mono8" else max(1, int(self.pixels.max()))
            grey = np.rint(self.pixels.astype(np.float32) * (255 / brightest)).astype(np.uint8)
            return np.repeat(grey[..., None], 3, axis=2)
        if self.pixels.ndim != 3:
            raise InputError(
                f"{self.topic} is {self.encoding}, not a colour picture: give --camera.color one."
            )
        order = 1 if self.encoding.startswith("rgb") else -1
        return np.ascontiguousarray(self.pixels[..., :3][..., ::order])

    def depth_m(self) -> Float32[np.ndarray, "h w"]:
        """Metres: 16UC1 and mono16 are in millimetres, 32FC1 in metres (REP 118); 0 for no reading, which NaN and
        infinity mean there. Raises InputError for a colour picture.
        """
        if self.pixels.ndim != 2 or self.encoding == "mono8":
            raise InputError(
                f"{self.topic} is {self.encoding}, not depth: give --camera.depth a depth picture."
            )
        unit_m = np.float32(1.0 if self.encoding == "32FC1" else 0.001)
        return np.nan_to_num(self.pixels.astype(np.float32) * unit_m, nan=0.0, posinf=0.0, neginf=0.0)


@dataclass(frozen=True)
class RosLens:
    """What CameraInfo tells of pictures of that size: an ideal pinhole, and how to make its picture, if it is not the
    one that was sent.
    """

    width: int
    height: int
    K: Float[np.ndarray, "3 3"]
    ideal: PinholeMap | None


def _either(*names: str) -> Any:
    """A field that ROS 1 and ROS 2 call differently."""
    return Field(validation_alias=AliasChoices(*names))


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class _Stamp(_Message):
    seconds: int = _either("secs", "sec")
    nanoseconds: int = _either("nsecs", "nanosec")


class _Header(_Message):
    stamp: _Stamp
    frame_id: str


class _Picture(_Message):
    header: _Header
    data: Base64Bytes

    def shown(self, topic: str, encoding: str, pixels: np.ndarray) -> RosImage:
        stamp = self.header.stamp
        stamp_s = stamp.seconds + 1e-9 * stamp.nanoseconds
        return RosImage(topic, encoding, pixels, stamp_s, self.header.frame_id.lstrip("/"))


_Side = Annotated[int, Field(gt=0, le=_MOST_SIDE_PX)]


class _Image(_Picture):
    height: _Side
    width: _Side
    step: int
    encoding: str
    is_bigendian: bool


class _CompressedImage(_Picture):
    format: str


class _CameraInfo(_Message):
    height: _Side
    width: _Side
    distortion_model: str = ""
    K: Annotated[list[float], Field(min_length=9, max_length=9)] = _either("K", "k")
    P: Annotated[list[float], Field(min_length=12, max_length=12)] = _either("P", "p")
    D: list[float] = _either("D", "d")


_Model = TypeVar("_Model", bound=_Message)


def read_image(topic: str, message: Any) -> RosImage:
    """A sensor_msgs/Image or CompressedImage. Raises InputError for another message, an encoding that is not known, and
    sizes that do not fit the data.
    """
    if isinstance(message, dict) and "format" in message and "encoding" not in message:
        return _decompressed(topic, _parsed(_CompressedImage, topic, message))
    image = _parsed(_Image, topic, message)
    height, width, step = image.height, image.width, image.step
    if image.encoding not in _PIXELS:
        raise InputError(
            f"{topic} has the encoding {image.encoding[:40]!r}; known are {', '.join(_PIXELS)}. Set the driver to one "
            "of these, or give the topic of a converted picture."
        )
    kind, channels = _PIXELS[image.encoding]
    type_ = np.dtype(kind).newbyteorder(">" if image.is_bigendian else "<")
    row = width * channels * type_.itemsize
    if step < row or len(image.data) != step * height:
        raise InputError(
            f"{topic}: {width}x{height} pixels of {image.encoding} in rows of {step} bytes do not fit the "
            f"{len(image.data)} bytes of its data. Was the message cut?"
        )
    rows = np.frombuffer(image.data, np.uint8).reshape(height, step)[:, :row]  # rows may be padded
    pixels = np.ascontiguousarray(rows).view(type_).astype(type_.newbyteorder("="))
    shape = (height, width, channels) if channels > 1 else (height, width)
    return image.shown(topic, image.encoding, pixels.reshape(shape))


def read_lens(topic: str, message: Any, rectified: bool) -> RosLens:
    """A sensor_msgs/CameraInfo. `rectified`: the pictures were rectified already, so that P holds, not K.

    Raises InputError for another message, a camera without calibration, and a lens that is not known.
    """
    info = _parsed(_CameraInfo, topic, message)
    K = np.reshape(info.P, (3, 4))[:, :3] if rectified else np.reshape(info.K, (3, 3))
    if K[0, 0] <= 0 or K[1, 1] <= 0:
        raise InputError(f"{topic}: its intrinsics are 0: the camera is not calibrated. Calibrate it in ROS.")
    if rectified or not any(info.D):
        return RosLens(info.width, info.height, K, None)
    if info.distortion_model not in _MODELS or len(info.D) > 8:
        raise InputError(
            f"{topic}: the distortion model {info.distortion_model!r} is not known. Rectify the pictures in ROS "
            "(image_proc), give their topics, and set --camera.rectified true."
        )
    # ROS has OpenCV's order.
    return RosLens(info.width, info.height, K, pinhole_map(K, (info.height, info.width), np.array(info.D)))


def _decompressed(topic: str, message: _CompressedImage) -> RosImage:
    """A CompressedImage of image_transport: JPEG or PNG, or a depth picture as PNG behind a header."""
    form = message.format
    if "compressedDepth" not in form:
        # OpenCV decodes to blue first, whatever the encoding was.
        return message.shown(topic, "bgr8", _decoded(topic, message.data, cv2.IMREAD_COLOR))
    encoding = form.partition(";")[0].strip()
    if "rvl" in form or encoding not in ("16UC1", "32FC1"):
        raise InputError(
            f"{topic} is compressed as {form[:60]!r}; torc reads 16UC1 and 32FC1 as png. Set compressedDepth/format to "
            "png, or give the topic of the plain picture."
        )
    counts = _decoded(topic, message.data[_DEPTH_HEADER.size :], cv2.IMREAD_UNCHANGED)
    if counts.dtype != np.uint16 or counts.ndim != 2:
        raise InputError(f"{topic}: compressed depth is a grey picture of 16 bits, not {counts.dtype}.")
    if encoding == "16UC1":
        return message.shown(topic, encoding, counts)
    # Metres are kept as inverse depth: counts = a / depth + b.
    _, a, b = _DEPTH_HEADER.unpack_from(message.data)
    with np.errstate(divide="ignore"):
        depth_m = np.where(counts > 0, a / (counts.astype(np.float32) - np.float32(b)), np.float32(np.nan))
    return message.shown(topic, encoding, depth_m.astype(np.float32))


def _decoded(topic: str, data: bytes, how: int) -> np.ndarray:
    try:
        found = cv2.imdecode(np.frombuffer(data, np.uint8), how)
    except cv2.error:
        found = None
    if found is None or max(found.shape[:2]) > _MOST_SIDE_PX:
        raise InputError(f"{topic}: its data are not a picture as JPEG or PNG. Was the message cut?")
    return np.asarray(found)


def _parsed(model: type[_Model], topic: str, message: Any) -> _Model:
    try:
        return model.model_validate(message)
    except ValidationError as error:
        kind = model.__name__.lstrip("_")
        raise InputError(
            f"{topic}: its message is not a sensor_msgs/{kind} of ROS 1 or ROS 2:\n{explain_faults(error)}\nIs this "
            "the right topic?"
        ) from None
