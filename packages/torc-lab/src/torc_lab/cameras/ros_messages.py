"""sensor_msgs/Image, CompressedImage and CameraInfo as rosbridge gives them, in the forms of ROS 1 and of ROS 2."""

import base64
import binascii
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from torc import InputError
from torc_lab.cameras.lens import PinholeMap, brown_conrady, pinhole_map

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
_MILLIMETRES = ("16UC1", "mono16")
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
        if self.encoding in _MILLIMETRES:
            return self.pixels.astype(np.float32) * np.float32(0.001)
        return np.nan_to_num(self.pixels.astype(np.float32), nan=0.0, posinf=0.0, neginf=0.0)


@dataclass(frozen=True)
class RosLens:
    """What CameraInfo tells of pictures of that size: an ideal pinhole, and how to make its picture, if it is not the
    one that was sent.
    """

    width: int
    height: int
    K: Float[np.ndarray, "3 3"]
    ideal: PinholeMap | None


def read_image(topic: str, message: Any) -> RosImage:
    """A sensor_msgs/Image or CompressedImage. Raises InputError for another message, an encoding that is not known, and
    sizes that do not fit the data.
    """
    if isinstance(message, dict) and "format" in message and "encoding" not in message:
        return _decompressed(topic, message)
    height, width, step = (_whole(topic, message, k) for k in ("height", "width", "step"))
    encoding, data = (_entry(topic, message, k) for k in ("encoding", "data"))
    if encoding not in _PIXELS:
        raise InputError(
            f"{topic} has the encoding {str(encoding)[:40]!r}; known are {', '.join(_PIXELS)}. Set the driver to one "
            "of these, or give the topic of a converted picture."
        )
    kind, channels = _PIXELS[encoding]
    type_ = np.dtype(kind).newbyteorder(">" if _entry(topic, message, "is_bigendian") else "<")
    row = width * channels * type_.itemsize
    raw = _bytes(topic, data)
    if not 0 < width <= _MOST_SIDE_PX or not 0 < height <= _MOST_SIDE_PX or step < row:
        raise InputError(f"{topic}: {width}x{height} pixels of {encoding} do not fit rows of {step} bytes.")
    if len(raw) != step * height:
        raise InputError(
            f"{topic}: {height} rows of {step} bytes make {step * height} bytes, but there are {len(raw)}. Was the "
            "message cut?"
        )
    rows = np.frombuffer(raw, np.uint8).reshape(height, step)[:, :row]  # rows may be padded
    pixels = np.ascontiguousarray(rows).view(type_).astype(type_.newbyteorder("="))
    header = _entry(topic, message, "header")
    return RosImage(
        topic=topic,
        encoding=encoding,
        pixels=pixels.reshape((height, width, channels) if channels > 1 else (height, width)),
        stamp_s=_seconds(topic, _entry(topic, header, "stamp")),
        frame_id=str(_entry(topic, header, "frame_id")).lstrip("/"),
    )


def read_lens(topic: str, message: Any, rectified: bool) -> RosLens:
    """A sensor_msgs/CameraInfo. `rectified`: the pictures were rectified already, so that P holds, not K.

    Raises InputError for another message, a camera without calibration, and a lens that is not known.
    """
    width, height = (_whole(topic, message, k) for k in ("width", "height"))
    K = _numbers(topic, message, "K", 9).reshape(3, 3)
    if rectified:
        K = _numbers(topic, message, "P", 12).reshape(3, 4)[:, :3]
    if K[0, 0] <= 0 or K[1, 1] <= 0:
        raise InputError(f"{topic}: its intrinsics are 0: the camera is not calibrated. Calibrate it in ROS.")
    coefficients = np.zeros(0) if rectified else _numbers(topic, message, "D")
    if not coefficients.any():
        return RosLens(width, height, K, None)
    model = str(message.get("distortion_model", ""))
    if model not in _MODELS or len(coefficients) > 8:
        raise InputError(
            f"{topic}: the distortion model {model!r} is not known. Rectify the pictures in ROS (image_proc), give "
            "their topics, and set --camera.rectified true."
        )
    # Both have OpenCV's order.
    return RosLens(width, height, K, pinhole_map(K, (height, width), brown_conrady(coefficients)))


def _decompressed(topic: str, message: Mapping[str, Any]) -> RosImage:
    """A CompressedImage of image_transport: JPEG or PNG, or a depth picture as PNG behind a header."""
    form, raw = str(message["format"]), _bytes(topic, _entry(topic, message, "data"))
    header = _entry(topic, message, "header")
    about: dict[str, Any] = {
        "topic": topic,
        "stamp_s": _seconds(topic, _entry(topic, header, "stamp")),
        "frame_id": str(_entry(topic, header, "frame_id")).lstrip("/"),
    }
    if "compressedDepth" not in form:
        # OpenCV decodes to blue first, whatever the encoding was.
        return RosImage(encoding="bgr8", pixels=_decoded(topic, raw, cv2.IMREAD_COLOR), **about)
    encoding = form.partition(";")[0].strip()
    if "rvl" in form or encoding not in ("16UC1", "32FC1"):
        raise InputError(
            f"{topic} is compressed as {form[:60]!r}; torc reads 16UC1 and 32FC1 as png. Set compressedDepth/format to "
            "png, or give the topic of the plain picture."
        )
    if len(raw) <= _DEPTH_HEADER.size:
        raise InputError(f"{topic}: its picture is empty. Was the message cut?")
    _, a, b = _DEPTH_HEADER.unpack_from(raw)
    counts = _decoded(topic, raw[_DEPTH_HEADER.size :], cv2.IMREAD_UNCHANGED)
    if counts.dtype != np.uint16 or counts.ndim != 2:
        raise InputError(f"{topic}: compressed depth is a grey picture of 16 bits, not {counts.dtype}.")
    if encoding == "16UC1":
        return RosImage(encoding=encoding, pixels=counts, **about)
    # Metres are kept as inverse depth: counts = a / depth + b.
    with np.errstate(divide="ignore"):
        depth_m = np.where(counts > 0, a / (counts.astype(np.float32) - np.float32(b)), np.float32(np.nan))
    return RosImage(encoding=encoding, pixels=depth_m.astype(np.float32), **about)


def _decoded(topic: str, raw: bytes, how: int) -> np.ndarray:
    try:
        found = cv2.imdecode(np.frombuffer(raw, np.uint8), how)
    except cv2.error:
        found = None
    if found is None or max(found.shape[:2]) > _MOST_SIDE_PX:
        raise InputError(f"{topic}: its data are not a picture as JPEG or PNG. Was the message cut?")
    return np.asarray(found)


def _bytes(topic: str, data: Any) -> bytes:
    try:
        return base64.b64decode(data, validate=True)
    except (TypeError, ValueError, binascii.Error) as error:
        raise InputError(f"{topic}: its data are not base64, as rosbridge writes them: {error}.") from error


def _entry(topic: str, message: Any, name: str) -> Any:
    if not isinstance(message, dict) or name not in message:
        raise InputError(f"{topic}: its messages have no '{name}'. Is this the right topic?")
    return message[name]


def _whole(topic: str, message: Any, name: str) -> int:
    value = _entry(topic, message, name)
    if not isinstance(value, int) or isinstance(value, bool):
        raise InputError(f"{topic}: its '{name}' is {str(value)[:40]!r}, not a whole number.")
    return value


def _numbers(topic: str, message: Any, name: str, count: int | None = None) -> Float[np.ndarray, "n"]:
    """A field of CameraInfo: upper case in ROS 1, lower case in ROS 2."""
    values = _entry(topic, message, name if isinstance(message, dict) and name in message else name.lower())
    try:
        numbers = np.array(values, dtype=float).ravel()
    except (TypeError, ValueError):
        numbers = np.full(1, np.nan)
    if not np.isfinite(numbers).all() or (count is not None and len(numbers) != count):
        raise InputError(f"{topic}: its '{name}' is {str(values)[:80]!r}, not {count or 'finite'} numbers.")
    return numbers


def _seconds(topic: str, stamp: Any) -> float:
    """{secs, nsecs} in ROS 1, {sec, nanosec} in ROS 2."""
    for whole, rest in (("sec", "nanosec"), ("secs", "nsecs")):
        if isinstance(stamp, dict) and whole in stamp:
            return _whole(topic, stamp, whole) + 1e-9 * _whole(topic, stamp, rest)
    raise InputError(f"{topic}: its stamp is {str(stamp)[:60]!r}, not a time of ROS 1 or ROS 2.")
