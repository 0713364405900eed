"""Select the grasps of one object to return: the best, none too similar, both free and blocked ones."""

import numpy as np
from jaxtyping import Bool, Float
from numba import njit

from torc.grasping.config import SelectionConfig


def thinned(
    scores: Float[np.ndarray, "n"],
    blocked: Bool[np.ndarray, "n"],
    Ts_world_tcp: Float[np.ndarray, "n 4 4"],
    config: SelectionConfig,
) -> np.ndarray:
    """Return indices of grasps that are not too similar: by falling score, first free, then blocked ones.

    These are more than are returned in the end, so that further checks can choose among them.
    """
    order = np.argsort(-scores, kind="stable")
    is_blocked = blocked[order]
    position_m2, cosine = config.position_m**2, float(np.cos(config.angle_rad))
    most = config.spare * config.max_per_object
    parts = (order[~is_blocked], order[is_blocked])
    return np.concatenate([part[_suppress(part, Ts_world_tcp, position_m2, cosine, most)] for part in parts])


def chosen(
    kept: np.ndarray, scores: Float[np.ndarray, "n"], blocked: Bool[np.ndarray, "n"], config: SelectionConfig
) -> np.ndarray:
    """Return the best of the indices `kept`, by falling score; ties by index.

    Free grasps get all places except a share reserved for blocked ones; unused places go to the other kind.
    """
    order = kept[np.lexsort((kept, -scores[kept]))]
    free, held_up = order[~blocked[order]], order[blocked[order]]
    reserved = min(len(held_up), int(np.ceil(config.min_blocked_share * config.max_per_object)))
    n_free = min(len(free), config.max_per_object - reserved)
    best = np.concatenate([free[:n_free], held_up[: config.max_per_object - n_free]])
    return best[np.lexsort((best, -scores[best]))]


@njit(cache=True, nogil=True)
def _suppress(order, Ts, distance2, cosine, limit):
    """Return which of the indices to keep, in the order of merit: greedy non-maximum suppression."""
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
                (Ts[i, 0, 3] - Ts[j, 0, 3]) ** 2
                + (Ts[i, 1, 3] - Ts[j, 1, 3]) ** 2
                + (Ts[i, 2, 3] - Ts[j, 2, 3]) ** 2
            )
            if gap > distance2:
                continue
            closing, approach = 0.0, 0.0
            for a in range(3):
                closing += Ts[i, a, 0] * Ts[j, a, 0]
                approach += Ts[i, a, 2] * Ts[j, a, 2]
            if abs(closing) > cosine and approach > cosine:
                duplicate = True
                break
        if not duplicate:
            keep[k] = True
            chosen[n] = i
            n += 1
    return keep
