"""SAM 2.1 as two ONNX files, run by onnxruntime on the processor: no torch. `python -m tools.sam2_onnx` writes them."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8
from PIL import Image

from torc.errors import InputError, TorcError
from torc.perception.embedded.model import onnx_session

ENCODER, DECODER = "vision_encoder.onnx", "prompt_encoder_mask_decoder.onnx"
PICTURE, BOXES, MASKS, EXPECTED = "pixel_values", "input_boxes", "pred_masks", "iou_scores"
MAPS = ("image_embeddings.0", "image_embeddings.1", "image_embeddings.2")
"""Names of the files' inputs and outputs: those of transformers' Sam2Model."""
_MEAN = np.array([0.485, 0.456, 0.406], np.float32)
_STD = np.array([0.229, 0.224, 0.225], np.float32)
"""Of ImageNet's colours, as SAM 2.1 was trained with."""
_AT_ONCE = 32
_REMEDY = (
    "`python -m tools.sam2_onnx --out DIR` in torc's checkout writes both files (docs/networks.md); then "
    "name the folder: --perception.folder DIR."
)


@dataclass(frozen=True)
class Sam2Onnx:
    """The two networks, and the side of the square picture that they take, pixels."""

    encoder: Any
    decoder: Any
    side_px: int


@lru_cache(maxsize=2)
def load_sam2_onnx(folder: str, threads: int) -> Sam2Onnx:
    """The networks of a folder; loaded once per process. Raises InputError, with the remedy, for files that are not
    there, or are others, and MissingDependencyError without onnxruntime.
    """
    if not folder:
        raise InputError(f"--perception sam2-onnx needs SAM 2.1 as ONNX files. {_REMEDY}")
    place = Path(folder).expanduser()
    encoder = _opened(place / ENCODER, threads, {PICTURE}, {*MAPS})
    decoder = _opened(place / DECODER, threads, {*MAPS, BOXES}, {MASKS, EXPECTED})
    shape = encoder.get_inputs()[0].shape
    if len(shape) != 4 or not isinstance(shape[2], int) or shape[2] != shape[3]:
        raise InputError(f"{place / ENCODER} takes pictures of shape {shape}; it must be a square. {_REMEDY}")
    return Sam2Onnx(encoder, decoder, shape[2])


def _opened(path: Path, threads: int, inputs: set[str], outputs: set[str]) -> Any:
    if not path.is_file():
        raise InputError(f"There is no file {path}. {_REMEDY}")
    try:
        session = onnx_session(path, threads)
    except TorcError:
        raise
    except Exception as error:  # onnxruntime's own errors share no class
        raise InputError(f"{path} is no file that onnxruntime reads ({error}). {_REMEDY}") from error
    has = {i.name for i in session.get_inputs()}, {o.name for o in session.get_outputs()}
    if has[0] != inputs or not outputs <= has[1]:
        raise InputError(
            f"{path} is another network: inputs {sorted(has[0])}, outputs {sorted(has[1])}; needed are "
            f"{sorted(inputs)} and {sorted(outputs)}. {_REMEDY}"
        )
    return session


def masks_in_boxes(
    rgb: UInt8[np.ndarray, "h w 3"], corners: Float32[np.ndarray, "n 4"], network: Sam2Onnx
) -> tuple[Bool[np.ndarray, "n h w"], Float32[np.ndarray, "n"]]:
    """As `torc.perception.sam.sam2.masks_in_boxes`: one mask for each box (left, top, right, bottom; pixels), and the
    overlap with the true mask that the network expects.
    """
    height, width = rgb.shape[:2]
    masks, expected = np.zeros((len(corners), height, width), bool), np.zeros(len(corners), np.float32)
    if len(corners) == 0:
        return masks, expected
    maps = network.encoder.run(list(MAPS), {PICTURE: picture_input(rgb, network.side_px)})
    scale = np.array([network.side_px / width, network.side_px / height] * 2, np.float32)
    for first in range(0, len(corners), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        given = dict(zip(MAPS, maps)) | {BOXES: (corners[part] * scale)[None]}
        logits, iou = network.decoder.run([MASKS, EXPECTED], given)
        for k, mask in enumerate(logits[0, :, 0], first):
            masks[k] = cv2.resize(mask, (width, height), interpolation=cv2.INTER_LINEAR) > 0
        expected[part] = iou[0, :, 0]
    return masks, expected


def picture_input(rgb: UInt8[np.ndarray, "h w 3"], side_px: int) -> Float32[np.ndarray, "1 3 s s"]:
    """The picture as the encoder takes it: a square, whatever its shape was."""
    square = Image.fromarray(rgb).resize((side_px, side_px), Image.Resampling.BILINEAR)
    colours = (np.asarray(square, np.float32) / 255 - _MEAN) / _STD
    return np.ascontiguousarray(np.moveaxis(colours, -1, 0)[None], np.float32)
