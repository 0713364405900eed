"""Masks for boxes, by SAM 2.1 (Ravi et al. 2024)."""

import numpy as np
from jaxtyping import Bool, Float32, UInt8

from torc_networks.sam.network import Network

_AT_ONCE = 32
"""Boxes that are decoded together: more need more memory."""


def masks_in_boxes(
    rgb: UInt8[np.ndarray, "h w 3"], corners: Float32[np.ndarray, "n 4"], network: Network
) -> tuple[Bool[np.ndarray, "n h w"], Float32[np.ndarray, "n"]]:
    """One mask for each box, and the overlap with the true mask that the network expects, 0 to 1. The picture is
    encoded once.

    Args:
        rgb: the picture.
        corners: left, top, right, bottom; pixels.
        network: a SAM 2.1.
    """
    masks = np.zeros((len(corners), *rgb.shape[:2]), bool)
    expected = np.zeros(len(corners), np.float32)
    if len(corners) == 0:
        return masks, expected
    given = network.inputs(images=rgb, input_boxes=[corners.tolist()])
    with network.running():
        maps = network.model.get_image_embeddings(given["pixel_values"])
        for first in range(0, len(corners), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            out = network.model(
                image_embeddings=list(maps),
                input_boxes=given["input_boxes"][:, part],
                multimask_output=False,
            )
            logits = out.pred_masks.float().cpu()
            (found,) = network.processor.post_process_masks(logits, given["original_sizes"].cpu())
            masks[part] = found[:, 0].numpy()
            expected[part] = out.iou_scores[0, :, 0].float().cpu().numpy()
    return masks, expected
