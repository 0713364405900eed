"""Boxes for words, by Grounding DINO (Liu et al. 2023), as the paper's perception finds objects."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, UInt8

from torc import InputError
from torc_networks.sam.network import Network

_STOP = "."
_LEAST_PX = 1.0
"""Boxes that are narrower or lower show nothing."""


@dataclass(frozen=True)
class Boxes:
    """What was found.

    Attributes:
        corners: left, top, right, bottom; pixels, within the picture.
        scores: per box and phrase, how surely it shows that, 0 to 1.
    """

    corners: Float32[np.ndarray, "n 4"]
    scores: Float32[np.ndarray, "n k"]


def as_phrase(words: str) -> str:
    """Words as the network reads one phrase: in lower case, without what ends a phrase (its model card)."""
    return " ".join(words.lower().replace(_STOP, " ").replace("?", " ").split())


def ground(rgb: UInt8[np.ndarray, "h w 3"], phrases: Sequence[str], network: Network) -> Boxes:
    """All boxes that the network makes for phrases in one call, unlikely ones too; none that holds a NaN.

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
    corners = _corners(middle, width, height)
    sides = corners[:, 2:] - corners[:, :2]
    # No comparison holds for a NaN.
    good = (sides >= _LEAST_PX).all(axis=1) & np.isfinite(scores).all(axis=1)
    return Boxes(corners[good], scores[good])


def _words_of(ids: np.ndarray, phrases: Sequence[str], network: Network) -> list[Bool[np.ndarray, "t"]]:
    """Per phrase which of the text's tokens are its words."""
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


def _corners(middle: Float32[np.ndarray, "n 4"], width: int, height: int) -> Float32[np.ndarray, "n 4"]:
    """From middle and sides, by the picture's, to corners in pixels."""
    half = middle[:, 2:] / 2
    corners = np.hstack([middle[:, :2] - half, middle[:, :2] + half]) * np.array(
        [width, height] * 2, np.float32
    )
    return np.clip(corners, 0, np.array([width, height] * 2, np.float32)).astype(np.float32)
