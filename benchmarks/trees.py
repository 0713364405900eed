"""How long the scores of a scene's grasps take: our compiled evaluation beside scikit-learn's, on the same trees.

    python -m benchmarks.trees [--repeats 15]

The trees are of the shipped model's size, fitted to random numbers. One thread each.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import tyro
from jaxtyping import Float

from tools.grasp_model.export import to_trees
from tools.grasp_model.train import Fit, TrainConfig, fit_trees, raw_probability
from torc.grasping.features import FEATURE_NAMES

NO_CALIBRATION = np.array([0.0, 1.0])


@dataclass(frozen=True)
class Args:
    """Time the scores of several numbers of grasps."""

    grasps: tuple[int, ...] = (500, 2000, 5000)
    repeats: int = 15
    """How often each is timed, in turn; medians are over these."""


def main(args: Args) -> None:
    rng = np.random.default_rng(0)
    features = rng.normal(size=(20_000, len(FEATURE_NAMES))).astype(np.float32)
    held = features[:, 0] + features[:, 1] * features[:, 2] + rng.normal(size=len(features)) > 0
    theirs = fit_trees(features, held, TrainConfig())
    empty = np.empty(0)
    ours = to_trees(Fit(theirs, NO_CALIBRATION, NO_CALIBRATION, empty, empty, FEATURE_NAMES))
    print(f"{len(ours.roots)} trees with {len(ours.feature)} nodes, {len(FEATURE_NAMES)} features")
    for count in args.grasps:
        x = features[:count]
        np.testing.assert_allclose(ours.score(x), raw_probability(theirs, x), atol=1e-6)
        pairs = [
            (_seconds(ours.score, x), _seconds(lambda x: raw_probability(theirs, x), x))
            for _ in range(args.repeats)
        ]
        mine, other = np.median(pairs, axis=0)
        print(
            f"{count:5d} grasps: {1e3 * mine:6.1f} ms, scikit-learn {1e3 * other:6.1f} ms, {other / mine:.1f} x"
        )


def _seconds(score: Callable[[np.ndarray], np.ndarray], features: Float[np.ndarray, "n f"]) -> float:
    start = time.perf_counter()
    score(features)
    return time.perf_counter() - start


if __name__ == "__main__":
    main(tyro.cli(Args))
