"""Run torc's two networks by onnxruntime, and cut the pictures of single objects that the descriptor takes."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

from torc.errors import MissingDependencyError

DATA = Path(__file__).parent / "data"
EYES, DESCRIPTOR = DATA / "eyes.onnx", DATA / "descriptor.onnx"
MULTIPLE_PX = 32
"""Sides of the segmentation network's inputs are multiples of this."""
SIDE_PX = 64
_RIM = 1.12
"""Side of the square that is cut out, as a multiple of the mask's longer side."""


def segment_patch(inputs: Float32[np.ndarray, "c h w"], threads: int = 1) -> Float32[np.ndarray, "o h w"]:
    """Return probabilities per pixel: that it shows an object, then per offset that its partner shows that object.

    The offsets are `instances.OFFSETS`. Raises MissingDependencyError without onnxruntime.
    """
    return np.asarray(onnx_session(EYES, threads).run(None, {"inputs": inputs[None]})[0][0])


def describe(crops: UInt8[np.ndarray, "n s s 4"], threads: int = 1) -> Float32[np.ndarray, "n d"]:
    """Describe the looks of objects by unit vectors, from their crops. Raises as `segment_patch`."""
    return np.asarray(onnx_session(DESCRIPTOR, threads).run(None, {"inputs": descriptor_inputs(crops)})[0])


def crop(rgb: UInt8[np.ndarray, "h w 3"], mask: Bool[np.ndarray, "h w"]) -> UInt8[np.ndarray, "s s 4"]:
    """Return the object on black, with the mask as fourth channel (0 or 255). Raises ValueError for an empty mask."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if len(rows) == 0:
        raise ValueError("An empty mask shows nothing.")
    top, left, bottom, right = rows[0], cols[0], rows[-1] + 1, cols[-1] + 1
    side = _RIM * max(bottom - top, right - left)
    scale = SIDE_PX / side
    # Moves the middle of the mask's box to the middle of the square.
    shift = [SIDE_PX / 2 - scale * (left + right) / 2, SIDE_PX / 2 - scale * (top + bottom) / 2]
    box = slice(top, bottom), slice(left, right)
    cut = np.dstack([rgb[box], 255 * mask[box].astype(np.uint8)])
    cut[~mask[box]] = 0
    if scale < 0.7:
        cut = cv2.GaussianBlur(cut, (0, 0), 0.35 / scale)
    M = np.array([[scale, 0, shift[0] + scale * left], [0, scale, shift[1] + scale * top]])
    out = cv2.warpAffine(cut, M, (SIDE_PX, SIDE_PX), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(out)


def descriptor_inputs(crops: UInt8[np.ndarray, "n s s 4"]) -> Float32[np.ndarray, "n 4 s s"]:
    """Return the descriptor's inputs: colours from -1 to 1 inside the mask, 0 elsewhere; the mask."""
    mask = crops[..., 3:].astype(np.float32) / 255
    color = (crops[..., :3].astype(np.float32) / 127.5 - 1) * mask
    return np.ascontiguousarray(np.moveaxis(np.concatenate([color, mask], axis=-1), -1, 1))


@lru_cache(maxsize=8)
def onnx_session(
    path: Path, threads: int, feature: str = "Perception by torc's own networks", gpu: bool = False
) -> Any:
    """Open an ONNX file for the processor, or the GPU if there is one; cached.

    Raises MissingDependencyError, naming the feature, without onnxruntime.
    """
    try:
        import onnxruntime
    except ImportError as error:
        raise MissingDependencyError(feature, "pip install onnxruntime") from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    # Spinning threads would take the processor from everyone else.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 3
    wanted = ("CUDAExecutionProvider", "CPUExecutionProvider") if gpu else ("CPUExecutionProvider",)
    providers = [p for p in wanted if p in onnxruntime.get_available_providers()]
    return onnxruntime.InferenceSession(str(path), options, providers=providers)
