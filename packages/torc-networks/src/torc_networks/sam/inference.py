"""Run the networks: boxes for words, masks for boxes, masks for words."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32, UInt8

from torc import InputError
from torc_networks.fields import Masks
from torc_networks.sam.network import Network

_STOP = "."
_LEAST_PX = 1.0
"""Narrower or lower boxes show nothing."""
_AT_ONCE = 32
"""Number of boxes that are decoded together: more need more memory."""
_MASK_P = 0.5


@dataclass(frozen=True)
class Boxes:
    """Boxes found for phrases.

    Attributes:
        corners: left, top, right, bottom; pixels, within the picture.
        scores: per box and phrase, how surely it shows that, 0 to 1.
    """

    corners: Float32[np.ndarray, "n 4"]
    scores: Float32[np.ndarray, "n k"]


def as_phrase(words: str) -> str:
    """Return words as Grounding DINO reads one phrase: lower case, without what ends a phrase (its model card)."""
    return " ".join(words.lower().replace(_STOP, " ").replace("?", " ").split())


def ground(rgb: UInt8[np.ndarray, "h w 3"], phrases: Sequence[str], network: Network) -> Boxes:
    """Return all boxes for phrases by Grounding DINO (Liu et al. 2023) in one call, unlikely ones too, none with a NaN.

    The score of a single phrase is that of the likeliest word in the text, as transformers and the networks' authors
    read it; of one among several, that of the likeliest word in the phrase. Raises InputError for phrases without
    words, or with too many for the network.
    """
    height, width = rgb.shape[:2]
    text = " ".join(f"{p}{_STOP}" for p in phrases)
    given = network.inputs(images=rgb, text=text)
    limit = network.model.config.max_text_len
    if given["input_ids"].shape[1] > limit:
        raise InputError(f"Grounding DINO reads {limit} tokens at most; shorten '{text[:60]}...'.")
    with network.running():
        out = network.model(**given)
        logits, middle = (t[0].float().cpu().numpy() for t in (out.logits, out.pred_boxes))
    ids = given["input_ids"][0].cpu().numpy()
    words = _words_of(ids, phrases, network)
    with np.errstate(over="ignore"):
        p = 1 / (1 + np.exp(-logits[:, : len(ids)]))
    scores = np.stack([p[:, w].max(axis=1) for w in words], axis=1).astype(np.float32)
    half, size = middle[:, 2:] / 2, np.array([width, height] * 2, np.float32)
    corners = np.hstack([middle[:, :2] - half, middle[:, :2] + half]) * size
    corners = np.clip(corners, 0, size).astype(np.float32)
    sides = corners[:, 2:] - corners[:, :2]
    # No comparison holds for a NaN.
    good = (sides >= _LEAST_PX).all(axis=1) & np.isfinite(scores).all(axis=1)
    return Boxes(corners[good], scores[good])


def _words_of(ids: np.ndarray, phrases: Sequence[str], network: Network) -> list[Bool[np.ndarray, "t"]]:
    """Return, per phrase, which of the text's tokens are its words."""
    if len(phrases) == 1:
        return [np.ones(len(ids), bool)]
    tokenizer = network.processor.tokenizer
    stop = tokenizer.convert_tokens_to_ids(_STOP)
    number = np.cumsum(ids == stop) - (ids == stop)
    plain = (ids != stop) & ~np.isin(ids, tokenizer.all_special_ids) | (ids == tokenizer.unk_token_id)
    found = [plain & (number == k) for k in range(len(phrases))]
    if not all(w.any() for w in found):
        raise InputError(f"Grounding DINO finds no words in one of {list(phrases)}: describe it in words.")
    return found


def masks_in_boxes(
    rgb: UInt8[np.ndarray, "h w 3"], corners: Float32[np.ndarray, "n 4"], network: Network
) -> Masks:
    """Return a mask per box by SAM 2.1 (Ravi et al. 2024); its score is the overlap with the true mask that the network
    expects. The picture is encoded once. Corners as in `Boxes`.
    """
    masks = np.zeros((len(corners), *rgb.shape[:2]), bool)
    expected = np.zeros(len(corners), np.float32)
    if len(corners) == 0:
        return Masks(masks, expected)
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
    return Masks(masks, expected)


def segment_concepts(
    rgb: UInt8[np.ndarray, "h w 3"], concepts: Sequence[str], thresholds: Sequence[float], network: Network
) -> list[Masks]:
    """Return what shows each concept by SAM 3 (Carion et al. 2025), with scores above the concept's threshold.

    A score is how likely the mask is, times how likely it is that the picture shows the concept at all. The picture is
    encoded once. Raises InputError for a concept with too many words for the network.
    """
    words = [network.inputs(text=concept) for concept in concepts]
    limit = network.model.config.text_config.max_position_embeddings
    for concept, read in zip(concepts, words, strict=True):
        if read["input_ids"].shape[1] > limit:
            raise InputError(
                f"SAM 3 reads {limit} tokens at most, about {limit // 2} words; shorten '{concept[:60]}...'."
            )
    given = network.inputs(images=rgb)
    with network.running():
        maps = network.model.get_vision_features(pixel_values=given["pixel_values"])
        return [_shown(maps, w, t, rgb.shape[:2], network) for w, t in zip(words, thresholds, strict=True)]


def _shown(
    maps: Any, words: dict[str, Any], threshold: float, shape: tuple[int, ...], network: Network
) -> Masks:
    out = network.model(vision_embeds=maps, **words)
    for name in ("pred_logits", "pred_masks", "pred_boxes", "presence_logits"):
        out[name] = out[name].float()
    (found,) = network.processor.post_process_instance_segmentation(
        out, threshold=threshold, mask_threshold=_MASK_P, target_sizes=[tuple(shape)]
    )
    masks = found["masks"].cpu().numpy().astype(bool).reshape(-1, *shape)
    return Masks(masks, found["scores"].cpu().numpy().astype(np.float32))
