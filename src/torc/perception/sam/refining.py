"""The stage `--perception sam2-onnx`: as `embedded`, but SAM 2.1 redraws the masks, prompted by their boxes.

torc's own network says what is one object, from shape above all; SAM 2.1 knows outlines. A mask that it draws elsewhere
is not believed.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float32, Int16

from torc.errors import InputError
from torc.perception.embedded.perception import EmbeddedConfig, EmbeddedPerception
from torc.perception.proposals import LayoutConfig, Proposals, lay_out
from torc.perception.sam.onnx_files import load_sam2_onnx, masks_in_boxes
from torc.records import Observation
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class Sam2OnnxConfig(EmbeddedConfig):
    """Settings of SAM 2.1 as ONNX files; weights of facebook/sam2.1-hiera-* are under Apache-2.0.

    Attributes:
        folder: holds vision_encoder.onnx and prompt_encoder_mask_decoder.onnx, as `python -m tools.sam2_onnx` writes
            them.
        rim_px: boxes are larger than torc's own masks by this on all sides.
        agree: a new mask counts if it agrees so far (intersection over union) with torc's own, which stays otherwise.
        layout: how new masks that overlap are told apart; rule 1 is torc's own network's business.
    """

    folder: str = ""
    rim_px: int = 2
    agree: float = 0.5
    layout: LayoutConfig = field(default_factory=lambda: LayoutConfig(min_pixels=1))

    def __post_init__(self) -> None:
        if self.rim_px < 0 or not 0 <= self.agree <= 1:
            raise InputError("Sam2OnnxConfig: rim_px must not be negative, agree must be from 0 to 1.")


class Sam2OnnxPerception(EmbeddedPerception):
    """torc's own eyes with SAM 2.1's outlines."""

    config: Sam2OnnxConfig

    def __init__(self, config: Sam2OnnxConfig | None = None, workspace: Workspace | None = None) -> None:
        super().__init__(Sam2OnnxConfig() if config is None else config, workspace)

    def masks(self, observation: Observation) -> tuple[Int16[np.ndarray, "h w"], Float32[np.ndarray, "n"]]:
        """Number of the mask per pixel of the picture, -1 for none, and how surely each is one object, as torc's own
        network says. Raises as `load_sam2_onnx`.
        """
        config = self.config
        network = load_sam2_onnx(config.folder, config.threads)
        label, sureness = super().masks(observation)
        own = label == np.arange(len(sureness), dtype=np.int16)[:, None, None]
        drawn, _ = masks_in_boxes(observation.rgb, boxes_around(own, config.rim_px), network)
        chosen = np.where(agreeing(own, drawn, config.agree)[:, None, None], drawn, own)
        laid = lay_out(Proposals(chosen, sureness, np.zeros(len(sureness), np.float32)), config.layout)
        return laid.label, laid.sureness


def boxes_around(masks: Bool[np.ndarray, "n h w"], rim_px: int) -> Float32[np.ndarray, "n 4"]:
    """Left, top, right and bottom of each mask in pixels, with a rim, within the picture. No mask is empty."""
    height, width = masks.shape[1:]
    boxes = np.zeros((len(masks), 4), np.float32)
    for box, mask in zip(boxes, masks):
        rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        low, high = (cols[0], rows[0]), (cols[-1] + 1, rows[-1] + 1)
        box[:2] = np.maximum(np.array(low) - rim_px, 0)
        box[2:] = np.minimum(np.array(high) + rim_px, (width, height))
    return boxes


def agreeing(
    own: Bool[np.ndarray, "n h w"], drawn: Bool[np.ndarray, "n h w"], agree: float
) -> Bool[np.ndarray, "n"]:
    """Which of the masks agree so far, as intersection over union, and have pixels at all."""
    common, union = (np.count_nonzero(m, axis=(1, 2)) for m in (own & drawn, own | drawn))
    return np.asarray((common >= agree * union) & (common > 0))
