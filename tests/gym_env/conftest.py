"""The environment on a table of analytic shapes."""

import pytest

from tests.helpers.fake_episode import FakeSimulation
from tests.helpers.fake_trial import SHAPES
from torc.gym_env.env import RetrievalEnv


@pytest.fixture
def make_env(robot):
    """Environments whose robot obeys; `results` scripts the picks of each episode."""

    def make(shapes=SHAPES, results=(), **settings):
        simulation = FakeSimulation(robot, shapes, results)
        return RetrievalEnv("structured-01,structured-02", simulation=simulation, **settings)

    return make
