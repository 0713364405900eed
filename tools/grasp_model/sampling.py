"""Which candidates are tried."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from tools.grasp_model.dataset import Policy
from tools.grasp_model.snapshot import Snapshot


@dataclass(frozen=True)
class SamplingConfig:
    """How many candidates are tried, and which.

    Attributes:
        first_trials, later_trials: trials of a scene's first snapshot and of each later one, about.
        min_per_object, max_per_object: trials per object.
        random_share: share drawn from all valid candidates with equal chances; the others are spread over ranks.
        invalid_share: share of candidates that a check rejects.
    """

    first_trials: int = 48
    later_trials: int = 32
    min_per_object: int = 2
    max_per_object: int = 8
    random_share: float = 0.3
    invalid_share: float = 0.08


def choose_for_training(
    snapshot: Snapshot, stage: int, rng: np.random.Generator, config: SamplingConfig
) -> list[tuple[int, Policy]]:
    """Per visible object its best candidate, some spread over the ranks of the hand-written score, some random."""
    ids = np.unique(snapshot.grasps.object_ids)
    total = config.first_trials if stage == 0 else config.later_trials
    count = int(np.clip(round(total / max(len(ids), 1)), config.min_per_object, config.max_per_object))
    chosen: list[tuple[int, Policy]] = []
    for object_id in ids:
        mine = np.flatnonzero(snapshot.grasps.object_ids == object_id)
        valid = mine[snapshot.valid[mine]]
        invalid = mine[~snapshot.valid[mine]]
        ranked = valid[np.argsort(-snapshot.p_hand[valid], kind="stable")]
        chosen += _spread_and_random(ranked, count, rng, config)
        if len(invalid) and rng.random() < config.invalid_share * count:
            chosen.append((int(rng.choice(invalid)), Policy.INVALID))
    return chosen


def _spread_and_random(
    ranked: np.ndarray, count: int, rng: np.random.Generator, config: SamplingConfig
) -> list[tuple[int, Policy]]:
    """Up to `count` different candidates of one object, `ranked` best first."""
    if len(ranked) <= count:
        return [(int(i), Policy.TOP_HAND if k == 0 else Policy.SPREAD) for k, i in enumerate(ranked)]
    chosen = {int(ranked[0]): Policy.TOP_HAND}
    n_random = rng.binomial(count - 1, config.random_share)
    edges = np.linspace(0.0, 1.0, count - n_random)
    for low, high in pairwise(edges):
        # Squared: half of the draws fall into the best quarter of the ranks, where choices are made.
        rank = int(rng.uniform(low, high) ** 2 * len(ranked))
        chosen.setdefault(int(ranked[min(rank, len(ranked) - 1)]), Policy.SPREAD)
    for i in rng.choice(ranked, n_random, replace=False):
        chosen.setdefault(int(i), Policy.RANDOM)
    return list(chosen.items())


def choose_for_evaluation(
    snapshot: Snapshot, p_model: Float[np.ndarray, "n"], rng: np.random.Generator
) -> list[tuple[int, Policy]]:
    """Per visible object with a valid candidate: the best by the model, the best by hand, and a random one."""
    chosen = []
    for object_id in np.unique(snapshot.grasps.object_ids):
        valid = np.flatnonzero((snapshot.grasps.object_ids == object_id) & snapshot.valid)
        if len(valid) == 0:
            continue
        chosen.append((int(valid[np.argmax(p_model[valid])]), Policy.TOP_MODEL))
        chosen.append((int(valid[np.argmax(snapshot.p_hand[valid])]), Policy.TOP_HAND))
        chosen.append((int(rng.choice(valid)), Policy.RANDOM))
    return chosen
