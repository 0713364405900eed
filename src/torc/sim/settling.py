"""Let objects come to rest, pile them up, and check whether a settled scene stays still."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from jaxtyping import Float

from torc.problems.problem import Problem
from torc.sim.simulated_world import Presence, World, build_world
from torc.sim.spec import WorldConfig
from torc.sim.stepping import Watchdog
from torc.workspace.description import Box, Workspace

UNSEEN = WorldConfig(surfaces=False)
"""For worlds that are not drawn."""
COARSE = replace(UNSEEN, timestep_s=0.004, implicit=False)
"""For worlds in which objects are only piled up, let down, and tested for creeping: they cost half the computing time,
and piles creep no less. Where numbers matter, a world like those of trials decides.
"""
_CLEARANCE_M = 0.04
"""An object of a pile is let go this far above everything else. More makes them bounce over the walls."""
EASED_M, _EASING_STEPS = 0.002, 1000
"""Ordinary settling copes with objects that are inside each other by this much."""


@dataclass(frozen=True)
class SettleConfig:
    """When a scene counts as settled: every object's linear + radius x angular speed stays below a limit for `quiet_s`.

    Longer finds slower topples; for the slowest see `watch_stillness`. The radius is a typical object's half size.
    """

    speed_m_s: float = 0.005
    quiet_s: float = 0.3
    radius_m: float = 0.05
    limit_s: float = 6.0
    check_s: float = 0.05


@dataclass(frozen=True)
class SettleReport:
    """The result of settling.

    Attributes:
        settled: True if all objects on the table came to rest within the limit.
        duration_s: simulated time it took.
        max_speed_m_s: speed of the fastest object on the table at the end.
        left: ids of the objects that are no longer on the table.
    """

    settled: bool
    duration_s: float
    max_speed_m_s: float
    left: tuple[int, ...]


@dataclass(frozen=True)
class DumpConfig:
    """How an unstructured pile is made.

    Attributes:
        walls_size_m: inner lengths of the temporary walls along x and y; without walls, every third object is lost.
        places: how many places are tried for each object; it is let go above the one where it comes lowest, so that
            it falls least and the pile grows in layers. With one it is let go above all others, wherever they lie.
    """

    center_xy: tuple[float, float] = (0.65, -0.12)
    walls_size_m: tuple[float, float] = (0.42, 0.46)
    interval_s: float = 0.3
    places: int = 1


def settle(world: World, config: SettleConfig | None = None) -> SettleReport:
    """Run the world until every object on the table is at rest, or the limit is reached. Raises PhysicsError."""
    config = config or SettleConfig()
    steps = max(1, round(config.check_s / world.model.opt.timestep))
    watchdog = _watch(world)
    began, elapsed, quiet = world.time_s, 0.0, 0.0
    speed = np.inf
    while elapsed < config.limit_s and quiet < config.quiet_s:
        mujoco.mj_step(world.model, world.data, nstep=steps)
        watchdog.check()
        elapsed += config.check_s
        # Objects that fell off do not delay the others.
        speed = float(world.speeds(config.radius_m)[list(world.on_table())].max(initial=0.0))
        quiet = quiet + config.check_s if speed < config.speed_m_s else 0.0
    world.update_position_stage()
    return SettleReport(quiet >= config.quiet_s, world.time_s - began, speed, world.off_table())


def settle_problem(
    problem: Problem,
    workspace: Workspace,
    config: SettleConfig | None = None,
    world_config: WorldConfig | None = None,
) -> tuple[Problem, SettleReport]:
    """Return the problem with its objects where they come to rest, and the report (objects may have left the table).

    Raises PhysicsError, e.g. because objects were placed inside each other.
    """
    world = build_world(problem, None, workspace, world_config or UNSEEN)
    report = settle(world, config)
    return with_poses_of(world), report


def with_poses_of(world: World) -> Problem:
    """Return the world's problem with the objects' present poses."""
    names = [placement.name for placement in world.problem.ordered()]
    poses = dict(zip(names, zip(map(tuple, world.positions.tolist()), map(tuple, world.wxyz.tolist()))))
    moved = tuple(replace(o, position=poses[o.name][0], wxyz=poses[o.name][1]) for o in world.problem.objects)
    return replace(world.problem, objects=moved)


def dump(
    problem: Problem,
    workspace: Workspace,
    rng: np.random.Generator,
    config: DumpConfig | None = None,
    settle_config: SettleConfig | None = None,
    world_config: WorldConfig | None = None,
) -> tuple[Problem, SettleReport]:
    """Make an unstructured pile of the problem's objects, whatever their poses were.

    They are let go in a random order and orientation between temporary walls, which are then removed. Returns the
    problem with settled poses, and the report of settling without walls. Raises PhysicsError.
    """
    config = config or DumpConfig()
    world_config = world_config or UNSEEN
    world = build_world(problem, None, workspace, world_config, _walls(workspace, config))
    for object_id in range(world.object_count):
        world.park(object_id, Presence.DROPPED)
    for object_id in rng.permutation(world.object_count):
        world.unpark(int(object_id), *_pose_above(world, int(object_id), rng, config))
        run(world, config.interval_s)
    settle(world, settle_config)
    return settle_problem(with_poses_of(world), workspace, settle_config, world_config)


def run(world: World, seconds: float, check_s: float = 0.05) -> None:
    """Run the world, checking for broken physics every check_s. Raises PhysicsError."""
    left = round(seconds / world.model.opt.timestep)
    chunk = max(1, round(check_s / world.model.opt.timestep))
    watchdog = _watch(world)
    while left > 0:
        mujoco.mj_step(world.model, world.data, nstep=min(chunk, left))
        watchdog.check()
        left -= chunk


def _watch(world: World) -> Watchdog:
    watchdog = Watchdog(world)
    world.update_position_stage()
    watchdog.check()
    return watchdog


def _pose_above(
    world: World, object_id: int, rng: np.random.Generator, config: DumpConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Return a random place between the walls above what else is in the scene, and a random orientation."""
    radii = np.array([0.5 * float(np.linalg.norm(model.size_m)) for model in world.models])
    half = np.maximum(0.5 * np.array(config.walls_size_m) - radii[object_id], 0.0)
    places = config.center_xy + rng.uniform(-1, 1, (config.places, 2)) * half
    # How high the highest thing reaches below each place, with objects as spheres.
    centers, reach = world.positions[world.present], radii[world.present]
    apart = np.linalg.norm(places[:, None] - centers[None, :, :2], axis=2)
    near = apart < reach + (radii[object_id] if config.places > 1 else np.inf)
    tops = np.where(near, centers[:, 2] + reach, -np.inf).max(axis=1, initial=-np.inf)
    below = np.maximum(tops, world.workspace.support_z_m)
    lowest = int(np.argmin(below))
    q = rng.standard_normal(4)
    z = below[lowest] + radii[object_id] + _CLEARANCE_M
    return np.array([*places[lowest], z]), q / np.linalg.norm(q)


def _walls(workspace: Workspace, config: DumpConfig) -> tuple[Box, ...]:
    (x, y), (lx, ly), h, t = config.center_xy, config.walls_size_m, 0.6, 0.1
    z = workspace.support_z_m + h / 2
    return (
        Box("pen_front", (x - lx / 2 - t / 2, y, z), (t, ly + 2 * t, h)),
        Box("pen_back", (x + lx / 2 + t / 2, y, z), (t, ly + 2 * t, h)),
        Box("pen_left", (x, y + ly / 2 + t / 2, z), (lx, t, h)),
        Box("pen_right", (x, y - ly / 2 - t / 2, z), (lx, t, h)),
    )


def ease_apart(world: World) -> tuple[float, float]:
    """Push overlapping objects apart until ordinary settling copes with the deepest overlap, and set nothing in motion:
    all are stopped after every time step. Returns how deep the deepest two bodies were inside each other before and
    after, metres.
    """

    def deepest_m() -> float:
        return float(np.max(-world.data.contact.dist, initial=0.0))

    world.update_position_stage()
    before, steps = deepest_m(), 0
    while deepest_m() > EASED_M and steps < _EASING_STEPS:
        mujoco.mj_step(world.model, world.data)
        world.data.qvel[:] = 0.0
        steps += 1
    world.update_position_stage()
    return before, deepest_m()


@dataclass(frozen=True)
class StillnessConfig:
    """When a scene counts as still.

    Attributes:
        distance_m, angle_rad: no object may move or turn further from where it was at the start.
        early_s: after this time the watch ends as soon as every object's motion so far, plus `safety` times the
            expected rest at the pace of the last `pace_s`, is within the limits.
    """

    distance_m: float = 0.002
    angle_rad: float = float(np.deg2rad(2.0))
    seconds: float = 10.0
    check_s: float = 0.25
    early_s: float = np.inf
    pace_s: float = 1.0
    safety: float = 3.0


@dataclass(frozen=True)
class StillnessReport:
    """A scene left to itself: how far each object moved and turned (0 if not present), and which left the table."""

    still: bool
    watched_s: float
    distances_m: Float[np.ndarray, "n"]
    angles_rad: Float[np.ndarray, "n"]
    left: tuple[int, ...]

    @property
    def distance_m(self) -> float:
        return float(self.distances_m.max(initial=0.0))

    @property
    def angle_rad(self) -> float:
        return float(self.angles_rad.max(initial=0.0))


def watch_stillness(world: World, config: StillnessConfig | None = None) -> StillnessReport:
    """Run a world until an object has moved too far, or the time is up. Raises PhysicsError."""
    config = config or StillnessConfig()
    began, positions, wxyz, on_table = world.time_s, world.positions, world.wxyz, set(world.on_table())
    limits = np.array([config.distance_m, config.angle_rad])
    every = max(1, round(config.pace_s / config.check_s))
    history = [np.zeros((2, world.object_count))]
    watched = 0.0
    still, left = True, tuple[int, ...]()
    while still and watched < config.seconds - 1e-9:
        run(world, min(config.check_s, config.seconds - watched))
        watched += min(config.check_s, config.seconds - watched)
        moved = _moved(world, positions, wxyz)
        left = tuple(sorted(on_table - set(world.on_table())))
        still = bool((moved <= limits[:, None]).all()) and not left
        history.append(moved)
        if watched >= config.early_s and len(history) > every:
            pace = np.abs(moved - history[-1 - every]).max(axis=1) / config.pace_s
            expected = moved.max(axis=1) + config.safety * pace * (config.seconds - watched)
            if (expected <= limits).all():
                break
    world.update_position_stage()
    return StillnessReport(still, world.time_s - began, history[-1][0], history[-1][1], left)


def _moved(
    world: World, positions: Float[np.ndarray, "n 3"], wxyz: Float[np.ndarray, "n 4"]
) -> Float[np.ndarray, "2 n"]:
    cosine = np.clip(np.abs(np.sum(world.wxyz * wxyz, axis=1)), 0.0, 1.0)
    moved = np.stack([np.linalg.norm(world.positions - positions, axis=1), 2.0 * np.arccos(cosine)])
    return np.where(world.present, moved, 0.0)
