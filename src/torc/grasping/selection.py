"""The grasps of one object to hand on: the best, none too alike, both free and blocked ones."""

import numpy as np
from jaxtyping import Bool, Float
from numba import njit

from torc.grasping.config import SelectionConfig


def thinned(
    scores: Float[np.ndarray, "n"],
    blocked: Bool[np.ndarray, "n"],
    Rs: Float[np.ndarray, "n 3 3"],
    tips: Float[np.ndarray, "n 3"],
    config: SelectionConfig,
) -> np.ndarray:
    """Indices of grasps that are not too alike: by falling score, free ones and blocked ones apart.

    More than are handed on in the end, so that further checks can choose among them.
    """
    order = np.argsort(-scores, kind="stable")
    is_blocked = blocked[order]
    limit = config.spare * config.max_per_object
    parts = [_suppressed(order[part], Rs, tips, limit, config) for part in (~is_blocked, is_blocked)]
    return np.concatenate(parts)


def chosen(
    kept: np.ndarray, scores: Float[np.ndarray, "n"], blocked: Bool[np.ndarray, "n"], config: SelectionConfig
) -> np.ndarray:
    """The best of the indices `kept`, by falling score; ties by index.

    Free grasps have all places but a share that is held for blocked ones; unused places go to the other kind.
    """
    order = kept[np.lexsort((kept, -scores[kept]))]
    free, held_up = order[~blocked[order]], order[blocked[order]]
    reserved = min(len(held_up), int(np.ceil(config.min_blocked_share * config.max_per_object)))
    n_free = min(len(free), config.max_per_object - reserved)
    best = np.concatenate([free[:n_free], held_up[: config.max_per_object - n_free]])
    return best[np.lexsort((best, -scores[best]))]


def _suppressed(
    order: np.ndarray, Rs: np.ndarray, tips: np.ndarray, limit: int, config: SelectionConfig
) -> np.ndarray:
    """Greedy non-maximum suppression over indices in the order of merit."""
    keep = _suppress(order, Rs, tips, config.position_m**2, float(np.cos(config.angle_rad)), limit)
    return order[keep]


@njit(cache=True)
def _suppress(
    order: np.ndarray, Rs: np.ndarray, tips: np.ndarray, distance2: float, cosine: float, limit: int
) -> np.ndarray:
    keep = np.zeros(len(order), dtype=np.bool_)
    chosen = np.empty(limit, dtype=np.int64)
    n = 0
    for k in range(len(order)):
        if n == limit:
            break
        i = order[k]
        duplicate = False
        for m in range(n):
            j = chosen[m]
            gap = (
                (tips[i, 0] - tips[j, 0]) ** 2
                + (tips[i, 1] - tips[j, 1]) ** 2
                + (tips[i, 2] - tips[j, 2]) ** 2
            )
            if gap > distance2:
                continue
            closing, approach = 0.0, 0.0
            for a in range(3):
                closing += Rs[i, a, 0] * Rs[j, a, 0]
                approach += Rs[i, a, 2] * Rs[j, a, 2]
            if abs(closing) > cosine and approach > cosine:
                duplicate = True
                break
        if not duplicate:
            keep[k] = True
            chosen[n] = i
            n += 1
    return keep
