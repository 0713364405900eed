"""The suite for depths passes the shipped one and names what others break."""

from dataclasses import replace

import numpy as np
import pytest

from torc.perception.protocol import AsMeasured
from torc.testing.conformance import NonConformanceError
from torc.testing.depth_conformance import check_depth


class Millimetres:
    def measure(self, observation):
        return replace(observation, depth_m=1000 * observation.depth_m)


class Writes:
    def measure(self, observation):
        observation.depth_m[:] = 1.0
        return observation


class Double:
    def measure(self, observation):
        return replace(observation, depth_m=observation.depth_m.astype(float))


class Noisy:
    def measure(self, observation):
        noise = np.random.default_rng().random(observation.depth_m.shape, np.float32)
        return replace(observation, depth_m=observation.depth_m + noise)


def test_the_shipped_depth_conforms():
    check_depth(AsMeasured)


@pytest.mark.usefixtures("any_arrays")
@pytest.mark.parametrize(
    ("make", "told"),
    [(Millimetres, "metres"), (Writes, "changed"), (Double, "float32"), (Noisy, "two different depths")],
)
@pytest.mark.usefixtures("any_arrays")
def test_broken_depths_are_found(make, told):
    with pytest.raises(NonConformanceError, match=told):
        check_depth(make)
