"""Servers that answer with what a test says, and torc's own parts behind a server."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from network_helpers.network_servers import serving
from torc.geometry.transforms import make_pose
from torc.testing.contexts import box
from torc.testing.views import view_of
from torc_networks.addresses import ServerConfig
from torc_networks.serving.handlers import OwnParts


@pytest.fixture
def told():
    """What a server was asked last, by action."""
    return {}


@pytest.fixture
def server_of(told):
    """Settings of a server that gives these answers by action, or calls them with what it is asked."""
    running = []

    def make(timeout_s=120.0, **answers):
        def handler(action, answer):
            def handle(asked):
                told[action] = asked
                return answer(asked) if callable(answer) else answer

            return handle

        context = serving({action: handler(action, answer) for action, answer in answers.items()})
        running.append(context)
        return ServerConfig(context.__enter__().address, timeout_s)

    yield make
    for context in reversed(running):
        context.__exit__(None, None, None)


@pytest.fixture
def rays(rng):
    """Random poses: rotations about random axes, positions within a metre."""

    def make(n):
        Rs = Rotation.from_rotvec(rng.normal(size=(n, 3))).as_matrix()
        return np.stack([make_pose(R, p) for R, p in zip(Rs, rng.uniform(-1, 1, (n, 3)))])

    return make


@pytest.fixture(scope="session")
def own_parts(robot, workspace):
    """torc's own parts as handlers of a server."""
    return OwnParts(robot, workspace)


@pytest.fixture(scope="session")
def gripper(robot):
    return robot.gripper


@pytest.fixture(scope="session")
def view():
    """A box of 50 mm, 100 mm high, and a wide one beside it."""
    return view_of(box(0, 0.62, -0.10, (0.05, 0.05, 0.10)), box(1, 0.62, 0.12, (0.12, 0.12, 0.06)))


@pytest.fixture(scope="session")
def table_z(workspace):
    return workspace.support_z_m
