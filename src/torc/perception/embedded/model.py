"""Run torc's two networks by onnxruntime on the processor."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, UInt8

from torc.errors import MissingDependencyError
from torc.perception.embedded.crops import descriptor_inputs

DATA = Path(__file__).parent / "data"
EYES, DESCRIPTOR = DATA / "eyes.onnx", DATA / "descriptor.onnx"
MULTIPLE_PX = 32
"""Sides of the segmentation network's inputs are multiples of this."""


def segment_patch(inputs: Float32[np.ndarray, "c h w"], threads: int = 1) -> Float32[np.ndarray, "o h w"]:
    """Return probabilities per pixel: that it shows an object, then per offset that its partner shows that object.

    The offsets are `instances.OFFSETS`.

    Sides are multiples of MULTIPLE_PX. Raises MissingDependencyError without onnxruntime.
    """
    return np.asarray(onnx_session(EYES, threads).run(None, {"inputs": inputs[None]})[0][0])


def describe(crops: UInt8[np.ndarray, "n s s 4"], threads: int = 1) -> Float32[np.ndarray, "n d"]:
    """Describe the looks of objects by unit vectors, from their crops. Raises as `segment_patch`."""
    return np.asarray(onnx_session(DESCRIPTOR, threads).run(None, {"inputs": descriptor_inputs(crops)})[0])


@lru_cache(maxsize=8)
def onnx_session(path: Path, threads: int) -> Any:
    """Open an ONNX file for the processor; cached. Raises MissingDependencyError without onnxruntime."""
    try:
        import onnxruntime
    except ImportError as error:
        raise MissingDependencyError(
            "Perception by torc's own networks", "pip install onnxruntime"
        ) from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    # Spinning threads would take the processor from everyone else.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
