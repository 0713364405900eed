"""Answers for a mirror image, brought back to the picture."""

import numpy as np
from numpy.testing import assert_allclose

from torc.perception.embedded.inputs import CHANNELS
from torc.perception.embedded.instances import OFFSETS
from torc.perception.embedded.perception import both_ways

SHAPE = 96, 128


def answers(label: np.ndarray) -> np.ndarray:
    """What a network that is always right says: .2 where a partner lies outside of the picture."""
    h, w = label.shape
    out = np.full((1 + len(OFFSETS), h, w), 0.2, np.float32)
    out[0] = label >= 0
    for k, (dr, dc) in enumerate(OFFSETS, start=1):
        a, b = max(0, -dc), w - max(0, dc)
        same = (label[: h - dr, a:b] == label[dr:, a + dc : b + dc]) & (label[: h - dr, a:b] >= 0)
        out[k, : h - dr, a:b] = same
    return out


def test_a_network_that_is_always_right_says_the_same_both_ways():
    rng = np.random.default_rng(3)
    label = np.kron(rng.integers(-1, 4, (12, 16)), np.ones((8, 8), int))
    inputs = np.zeros((CHANNELS, *SHAPE), np.float32)
    inputs[0] = label
    inputs[2] = rng.standard_normal(SHAPE)

    def network(x: np.ndarray) -> np.ndarray:
        return answers(x[0].round().astype(int))

    assert_allclose(both_ways(network, inputs), network(inputs))


def test_each_answer_counts_half_and_the_normal_turns_round():
    inputs = np.random.default_rng(4).standard_normal((CHANNELS, *SHAPE)).astype(np.float32)
    seen = {}

    def network(x: np.ndarray) -> np.ndarray:
        answer = 1 if x is inputs else 2
        seen[answer] = x
        return np.full((1 + len(OFFSETS), *SHAPE), answer, np.float32)

    out = both_ways(network, inputs)
    assert_allclose(out[0], 1.5)
    assert set(np.unique(out[1:])) <= {1.0, 1.5}
    own, image = seen[1], seen[2]
    assert_allclose(image[2], -own[2][:, ::-1])
    assert_allclose(np.delete(image, 2, 0), np.delete(own, 2, 0)[..., ::-1])
