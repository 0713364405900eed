"""Cluttered scenes with simple grasps from above and from the robot's side."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from torc.collision.contacts import blockers
from torc.geometry.transforms import invert, make_pose
from torc.motion.protocol import PickRequest
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.records import GraspReport, GraspSet, GraspStatus
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik
from torc.testing.synthetic import Shape, SyntheticBox, half_sizes
from torc.testing.views import View, view_of, view_of_clutter
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace


@pytest.fixture(scope="session")
def planner(robot: RobotDescription, workspace: Workspace) -> SamplingMotionPlanner:
    return SamplingMotionPlanner(robot, workspace)


@pytest.fixture(scope="session")
def request_for(robot: RobotDescription, workspace: Workspace) -> Callable[[int], list[PickRequest]]:
    """Requests for all graspable objects of the scene with a seed, the arm at rest."""

    return cache(lambda seed: requests_of(view_of_clutter(seed, 9, workspace), robot))


@pytest.fixture(scope="session")
def request_behind(robot: RobotDescription, workspace: Workspace) -> Callable[[float], PickRequest]:
    """A request for the upper half of a tall box, all that is seen of it behind a lower one."""

    def request(y: float) -> PickRequest:
        table = workspace.support_z_m
        tall = SyntheticBox(1, (0.68, y, table + 0.14), (0.05, 0.05, 0.28))
        low = SyntheticBox(2, (0.57, y, table + 0.07), (0.04, 0.16, 0.14))
        view = view_of(tall, low, workspace=workspace)
        return next(r for r in requests_of(view, robot) if r.object_id == 1)

    return request


@pytest.fixture(scope="session")
def request_alone(robot: RobotDescription, workspace: Workspace) -> Callable[[float], PickRequest]:
    """A request for a small cube, alone on the table."""

    def request(y: float) -> PickRequest:
        cube = SyntheticBox(1, (0.62, y, workspace.support_z_m + 0.02), (0.04, 0.04, 0.04))
        return requests_of(view_of(cube, workspace=workspace), robot)[0]

    return request


@pytest.fixture(scope="session")
def shelf() -> Workspace:
    """Where things stand under a roof, between walls."""
    return load_workspace("deep-shelf")


@pytest.fixture(scope="session")
def requests_in_shelf(robot: RobotDescription, shelf: Workspace) -> list[PickRequest]:
    """Requests for boxes in the shelf, with grasps from the front."""
    places = enumerate((x, y) for x in (0.66, 0.76) for y in (-0.30, -0.21, -0.12, -0.03, 0.06))
    z = shelf.support_z_m
    boxes = [SyntheticBox(k, (x, y, z + 0.06), (0.05, 0.05, 0.12)) for k, (x, y) in places]
    views = [view_of(box, workspace=shelf) for box in boxes]
    return [r for view in views for r in requests_of(view, robot, tilts=(1.1, 1.3, 1.5))]


@pytest.fixture(scope="session")
def request_by_the_wall(robot: RobotDescription, shelf: Workspace) -> Callable[[float], PickRequest]:
    """A request for a tall box beside a wall of the shelf: lifted, it comes close to wall and roof."""

    def request(x: float) -> PickRequest:
        box = SyntheticBox(1, (x, -0.335, shelf.support_z_m + 0.1), (0.06, 0.06, 0.2))
        return requests_of(view_of(box, workspace=shelf), robot, tilts=(1.1, 1.3, 1.5))[0]

    return request


def requests_of(
    view: View, robot: RobotDescription, tilts: tuple[float, ...] = (0.0, 0.5, 0.9)
) -> list[PickRequest]:
    """Requests for all graspable objects of a view, the arm at rest."""
    scene = view.scene
    grasps = simple_grasps([s for s in view.shapes if s.id in scene.ids], robot, tilts)
    report = simple_report(grasps, view.world, robot, scene.ids)
    return [
        PickRequest(scene, view.volume, view.world, grasps, report, k, robot.arm.rest_qpos)
        for k in report.graspable_ids
    ]


def simple_grasps(shapes: list[Shape], robot: RobotDescription, tilts: tuple[float, ...]) -> GraspSet:
    """Grasps near the tops of shapes: tilted from straight down towards the robot's side, several yaws."""
    poses, ids = [], []
    for shape in shapes:
        top = shape.center[2] + half_sizes(shape)[2]
        p = np.array([shape.center[0], shape.center[1], max(top - 0.02, 1.056)])
        for tilt in tilts:
            for yaw in (0.0, 0.8, -0.8, 1.6):
                z = np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
                across = np.array([0.0, 1.0, 0.0])
                x = np.cos(yaw) * across + np.sin(yaw) * np.cross(z, across)
                poses.append(make_pose(np.stack([x, np.cross(z, x), z], axis=1), p))
                ids.append(shape.id)
    n = len(poses)
    return GraspSet(
        Ts_world_tcp=np.array(poses),
        widths_m=np.full(n, 0.05),
        scores=np.linspace(1.0, 0.1, n),
        object_ids=np.array(ids, dtype=np.int16),
        contacts=np.zeros((n, 2, 3)),
        generators=np.zeros(n, dtype=np.uint8),
        generator_names=("simple",),
    )


def simple_report(grasps: GraspSet, world, robot: RobotDescription, ids: tuple[int, ...]) -> GraspReport:
    """Valid is what has a free inverse-kinematics solution."""
    n = len(grasps)
    status = np.full(n, GraspStatus.UNREACHABLE, dtype=np.uint8)
    qpos = np.full((n, robot.arm.dof), np.nan)
    T_tcp_tool0 = invert(robot.gripper.T_tool0_tcp(0.05))
    solutions = solve_ik(robot.arm, grasps.Ts_world_tcp @ T_tcp_tool0)
    for i in range(n):
        q = solutions.of(i)[:8]
        if len(q) == 0:
            continue
        free = blockers(world, robot, q, robot.gripper.max_width_m, int(grasps.object_ids[i])).free
        status[i] = GraspStatus.VALID if free.any() else GraspStatus.BLOCKED
        qpos[i] = q[int(np.argmax(free))]
    valid = [int(np.sum((grasps.object_ids == k) & (status == GraspStatus.VALID))) for k in ids]
    k = len(ids)
    return GraspReport(
        status,
        qpos,
        np.zeros(n, dtype=np.uint64),
        ids,
        np.zeros((k, k), dtype=np.int32),
        np.zeros(k, dtype=np.int32),
        np.array(valid, dtype=np.int32),
    )
