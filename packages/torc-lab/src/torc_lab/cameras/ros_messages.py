"""Read sensor_msgs/Image, CompressedImage and CameraInfo from rosbridge, in the forms of ROS 1 and of ROS 2."""

import base64
import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from torc import InputError
from torc_lab.cameras.lens import PinholeMap, pinhole_map
from torc_lab.ros.messages import stamp_of

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
        """Return colours, red first. Raises InputError for a depth picture.

        Grey pictures get three equal channels; those of 16 bits are scaled to their brightest pixel.
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
        """Return depth in metres. Raises InputError for a colour picture.

        16UC1 and mono16 are in millimetres, 32FC1 in metres, with NaN and infinity for no reading (REP 118).
        """
        if self.pixels.ndim != 2 or self.encoding == "mono8":
            raise InputError(
                f"{self.topic} is {self.encoding}, not depth: give --camera.depth a depth picture."
            )
        return self.pixels.astype(np.float32) * np.float32(1.0 if self.encoding == "32FC1" else 0.001)


@dataclass(frozen=True)
class RosLens:
    """A lens as CameraInfo describes it: an ideal pinhole, and the map to its picture if the sent one differs."""

    width: int
    height: int
    K: Float[np.ndarray, "3 3"]
    ideal: PinholeMap | None


@contextmanager
def _reading(topic: str) -> Iterator[None]:
    """Turn every fault in the form of a message into one InputError."""
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, cv2.error) as error:
        raise InputError(
            f"{topic}: its message is not one of sensor_msgs of ROS 1 or ROS 2, or was cut ({type(error).__name__}: "
            f"{str(error)[:200]}). Is this the right topic?"
        ) from error


def read_image(topic: str, message: Any) -> RosImage:
    """Return a sensor_msgs/Image or CompressedImage as a RosImage.

    Raises InputError if it is another message, its encoding is unknown, or its size does not fit the data.
    """
    with _reading(topic):
        data = base64.b64decode(message["data"], validate=True)
        stamp_s, frame_id = stamp_of(message) or 0.0, str(message["header"]["frame_id"]).lstrip("/")
        if "format" in message and "encoding" not in message:
            return RosImage(topic, *_decompressed(topic, message["format"], data), stamp_s, frame_id)
        encoding = message["encoding"]
        if encoding not in _PIXELS:
            raise InputError(
                f"{topic} has the encoding {str(encoding)[:40]!r}; known are {', '.join(_PIXELS)}. Set the driver to "
                "one of these, or give the topic of a converted picture."
            )
        kind, channels = _PIXELS[encoding]
        type_ = np.dtype(kind).newbyteorder(">" if message["is_bigendian"] else "<")
        height, width, step = (int(message[k]) for k in ("height", "width", "step"))
        # Rows may be padded.
        rows = np.frombuffer(data, np.uint8).reshape(height, step)[:, : width * channels * type_.itemsize]
        shape = (height, width, channels) if channels > 1 else (height, width)
        pixels = np.ascontiguousarray(rows).view(type_).astype(type_.newbyteorder("=")).reshape(shape)
        return RosImage(topic, encoding, pixels, stamp_s, frame_id)


def read_lens(topic: str, message: Any, rectified: bool) -> RosLens:
    """Return the lens of a sensor_msgs/CameraInfo. If `rectified`, the pictures were rectified: P holds, not K.

    Raises InputError if it is another message, the camera is not calibrated, or the distortion model is unknown.
    """
    with _reading(topic):
        width, height, model = int(message["width"]), int(message["height"]), message["distortion_model"]
        if rectified:
            K, D = _numbers(message, "P").reshape(3, 4)[:, :3], np.zeros(0)
        else:
            K, D = _numbers(message, "K").reshape(3, 3), _numbers(message, "D")
    if K[0, 0] <= 0 or K[1, 1] <= 0:
        raise InputError(f"{topic}: its intrinsics are 0: the camera is not calibrated. Calibrate it in ROS.")
    if rectified or not D.any():
        return RosLens(width, height, K, None)
    if model not in _MODELS or len(D) > 8:
        raise InputError(
            f"{topic}: the distortion model {model!r} is not known. Rectify the pictures in ROS (image_proc), give "
            "their topics, and set --camera.rectified true."
        )
    # ROS has OpenCV's order.
    return RosLens(width, height, K, pinhole_map(K, (height, width), D))


def _numbers(message: Any, name: str) -> Float[np.ndarray, "n"]:
    """Return a field of CameraInfo: upper case in ROS 1, lower case in ROS 2."""
    numbers = np.array(message[name if name in message else name.lower()], dtype=float).ravel()
    if not np.isfinite(numbers).all():
        raise ValueError(f"{name} has {numbers.tolist()}")
    return numbers


def _decompressed(topic: str, form: str, data: bytes) -> tuple[str, np.ndarray]:
    """Return encoding and pixels of image_transport's JPEG or PNG, or of a depth picture as PNG behind a header."""
    if "compressedDepth" not in form:
        # OpenCV decodes to blue first, whatever the encoding was.
        return "bgr8", _decoded(data, cv2.IMREAD_COLOR)
    encoding = form.partition(";")[0].strip()
    if "rvl" in form or encoding not in ("16UC1", "32FC1"):
        raise InputError(
            f"{topic} is compressed as {form[:60]!r}; torc reads 16UC1 and 32FC1 as png. Set compressedDepth/format to "
            "png, or give the topic of the plain picture."
        )
    counts = _decoded(data[_DEPTH_HEADER.size :], cv2.IMREAD_UNCHANGED)
    if counts.dtype != np.uint16 or counts.ndim != 2:
        raise ValueError(f"compressed depth is a grey picture of 16 bits, not {counts.dtype}")
    if encoding == "16UC1":
        return encoding, counts
    # Metres are kept as inverse depth: counts = a / depth + b.
    _, a, b = _DEPTH_HEADER.unpack_from(data)
    with np.errstate(divide="ignore"):
        depth_m = np.where(counts > 0, a / (counts.astype(np.float32) - np.float32(b)), np.float32(np.nan))
    return encoding, depth_m.astype(np.float32)


def _decoded(data: bytes, how: int) -> np.ndarray:
    found = cv2.imdecode(np.frombuffer(data, np.uint8), how)
    if found is None:
        raise ValueError("the data are not a picture as JPEG or PNG")
    return np.asarray(found)
