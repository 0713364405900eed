"""Situations made by hand and at random, for the tests of the simulated VLM."""

import numpy as np

from torc.vlm.simulated.situation import Situation

HIDDEN = Situation(
    in_sight={1: 900, 2: 400, 3: 300, 4: 200},
    graspable=frozenset({2, 4}),
    lies_on=frozenset({(2, 1)}),
    hides={(1, 0): 150, (3, 0): 20, (4, 3): 60},
    blocks=frozenset({(1, 3), (4, 3)}),
    near=frozenset({(1, 2), (1, 3), (3, 4)}),
)
"""The target 0 is hidden, mostly by 1, on which 2 lies, and a little by 3, which 4 hides and blocks."""


def random_situation(rng: np.random.Generator, objects: int = 8) -> Situation:
    """Any facts whatever, cycles and contradictions among them; the target is in sight in about half of them."""
    ids = [int(k) for k in range(objects) if k or rng.random() < 0.5]
    pairs = [(a, b) for a in range(objects) for b in ids if a != b and rng.random() < 0.3]

    def some(share):
        return frozenset(p for p in pairs if rng.random() < share)

    return Situation(
        in_sight={k: int(rng.integers(20, 900)) for k in ids},
        graspable=frozenset(k for k in ids if rng.random() < 0.4),
        lies_on=frozenset(p for p in some(0.2) if p[0] < p[1]),
        hides={p: int(rng.integers(10, 500)) for p in sorted(some(0.4))},
        blocks=some(0.4),
        near=frozenset((a, b) for a, b in some(0.8) if a < b),
    )
