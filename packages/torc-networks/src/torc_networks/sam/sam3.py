"""Masks for concepts in words, by SAM 3 (Carion et al. 2025, "SAM 3: Segment Anything with Concepts")."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32, UInt8

from torc import InputError
from torc_networks.sam.network import Network

_MASK_P = 0.5


@dataclass(frozen=True)
class Instances:
    """What shows a concept: masks and their scores. A score is how likely the mask is, times how likely it is that the
    picture shows the concept at all: where it does not, all scores are low.
    """

    masks: Bool[np.ndarray, "n h w"]
    scores: Float32[np.ndarray, "n"]


def segment_concepts(
    rgb: UInt8[np.ndarray, "h w 3"], concepts: Sequence[str], thresholds: Sequence[float], network: Network
) -> list[Instances]:
    """The instances of each concept with scores above its threshold. The picture is encoded once. Raises InputError for
    a concept with too many words for the network.
    """
    words = [_read(concept, network) for concept in concepts]
    given = network.inputs(images=rgb)
    with network.running():
        maps = network.model.get_vision_features(pixel_values=given["pixel_values"])
        return [
            _instances(maps, w, t, rgb.shape[:2], network) for w, t in zip(words, thresholds, strict=True)
        ]


def _read(concept: str, network: Network) -> dict[str, Any]:
    words = network.inputs(text=concept)
    limit = network.model.config.text_config.max_position_embeddings
    if words["input_ids"].shape[1] > limit:
        raise InputError(
            f"SAM 3 reads {limit} tokens at most, about {limit // 2} words; shorten '{concept[:60]}...'."
        )
    return words


def _instances(
    maps: Any, words: dict[str, Any], threshold: float, shape: tuple[int, ...], network: Network
) -> Instances:
    out = network.model(vision_embeds=maps, **words)
    for name in ("pred_logits", "pred_masks", "pred_boxes", "presence_logits"):
        out[name] = out[name].float()
    (found,) = network.processor.post_process_instance_segmentation(
        out, threshold=threshold, mask_threshold=_MASK_P, target_sizes=[tuple(shape)]
    )
    masks = found["masks"].cpu().numpy().astype(bool).reshape(-1, *shape)
    return Instances(masks, found["scores"].cpu().numpy().astype(np.float32))
