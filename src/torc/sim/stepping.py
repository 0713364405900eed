"""Run the world in control periods, with an observer, and with a watchdog that detects broken physics.

A trial on broken physics is errored, never scored.
"""

from collections.abc import Callable

import mujoco
import numpy as np
from jaxtyping import Bool, Int

from torc.errors import PhysicsError
from torc.sim.simulated_world import World

Observer = Callable[[World], None]
"""Observes the world at intervals, e.g. to record a video; must change nothing."""
StepperState = tuple[int, float | None]
"""What a stepper remembers: the number of control periods so far, which schedules the watchdog, and since when two
bodies have been too deep in each other (None if they are not).
"""

_CONTROL_S = 0.004
"""Time between two commands to the servos, and between two readings of contact forces."""
_WATCHDOG_S, _OBSERVER_S = 0.02, 1.0 / 25.0
_BAD_NUMBERS = [int(getattr(mujoco.mjtWarning, f"mjWARN_BAD{of}")) for of in ("QPOS", "QVEL", "QACC")]
_BELOW_M = 0.10
_MAX_SPEED_M_S, _MAX_FALLING_SPEED_M_S = 5.0, 8.0
"""Limits for an object on or above the table (an arm moves it at about 1 m/s, a fall of 50 cm at 3), and for one below
the table top, or above the bin.
"""
_MAX_JOINT_SPEED_RAD_S = 60.0
_MAX_PENETRATION_M, _PENETRATION_S = 0.015, 0.1
"""Limits for two bodies inside each other, above the table: depth and duration. An object that falls 20 cm onto the
table sinks in by 15 mm for an instant.
"""
_MAX_IMPACT_PENETRATION_M = 0.04
"""Too deep even for an instant."""
_PARALLEL = 1e-3


class Stepper:
    """Steps a world. Nothing else advances time while a robot works."""

    def __init__(self, world: World, observer: Observer | None = None) -> None:
        self.world, self._observer = world, observer
        self._watchdog = Watchdog(world)
        timestep = world.model.opt.timestep
        self._steps = max(1, round(_CONTROL_S / timestep))
        self.period_s: float = self._steps * timestep
        """Time that one call of `step` takes."""
        self._watch_every = max(1, round(_WATCHDOG_S / self.period_s))
        self._observe_every = max(1, round(_OBSERVER_S / self.period_s))
        self._count = 0

    def step(self) -> None:
        """Run one control period. Raises PhysicsError if the simulation broke."""
        mujoco.mj_step(self.world.model, self.world.data, nstep=self._steps)
        self._count += 1
        if self._count % self._watch_every == 0:
            self._watchdog.check()
        if self._observer is not None and self._count % self._observe_every == 0:
            self._observer(self.world)

    def run(self, seconds: float) -> None:
        """Run several control periods with the servos' commands unchanged."""
        for _ in range(max(1, round(seconds / self.period_s))):
            self.step()

    def save(self) -> StepperState:
        return self._count, self._watchdog.deep_since_s

    def restore(self, state: StepperState) -> None:
        """Continue from a saved memory; the world must be in its state of that time, too."""
        self._count, self._watchdog.deep_since_s = state


class Watchdog:
    """Checks a world; a few dozen times per simulated second are enough."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.deep_since_s: float | None = None

    def check(self) -> None:
        """Check once. Raises PhysicsError for NaN, a body too fast, or two bodies too deep in each other."""
        data = self._world.data
        if data.warning.number[_BAD_NUMBERS].any() or not np.isfinite(data.qpos).all():
            raise self._error("The simulation diverged (NaN or huge numbers)")
        self._check_penetration()  # first: it names what is inside what, even if that made things fly
        self._check_speeds()

    def _check_penetration(self) -> None:
        world, contact = self._world, self._world.data.contact
        if contact.dist.min(initial=0.0) >= -_MAX_PENETRATION_M:
            self.deep_since_s = None
            return
        # Below the table, in the bin and on the floor, things land hard and sink in; that is harmless.
        below = contact.pos[:, 2] < world.workspace.support_z_m - _BELOW_M
        depths = np.where(below, 0.0, -contact.dist)
        # MuJoCo occasionally errs about thin pieces for an instant: a plate and a spatula that touch are 80 mm inside
        # each other.
        for i in np.flatnonzero(depths > _MAX_PENETRATION_M):
            depths[i] = min(depths[i], greatest_depth(world.model, world.data, contact.geom[i]))
        if depths.max(initial=0.0) <= _MAX_PENETRATION_M:
            self.deep_since_s = None
            return
        deepest = int(np.argmax(depths))
        # A restored state may set time back.
        since = world.time_s if self.deep_since_s is None else min(self.deep_since_s, world.time_s)
        self.deep_since_s = since
        if depths[deepest] > _MAX_IMPACT_PENETRATION_M or world.time_s - since >= _PENETRATION_S:
            geoms = contact.geom[deepest]
            a, b = (world.body_name_of_geom(g) for g in geoms)
            of_object = bool((world.geom_labels[geoms] >= 0).any())
            raise self._error(f"{a} and {b} are {1000 * depths[deepest]:.0f} mm inside each other", of_object)

    def _check_speeds(self) -> None:
        world = self._world
        # Half of the limit in each direction is below it in all.
        if np.abs(world.data.qvel).max(initial=0.0) <= 0.5 * _MAX_SPEED_M_S:
            return
        speeds = np.where(world.present, np.linalg.norm(world.velocities[:, :3], axis=1), 0.0)
        if speeds.max(initial=0.0) > _MAX_SPEED_M_S:
            limits = np.where(_may_fall(world), _MAX_FALLING_SPEED_M_S, _MAX_SPEED_M_S)
            worst = int(np.argmax(speeds - limits))
            if speeds[worst] > limits[worst]:
                name = world.problem.ordered()[worst].name
                raise self._error(f"Object {worst} ({name}) moves at {speeds[worst]:.1f} m/s")
        joints = np.abs(world.data.qvel[world.robot_dofs])
        if joints.max(initial=0.0) > _MAX_JOINT_SPEED_RAD_S:
            raise self._error(f"A robot joint turns at {joints.max():.0f} rad/s")

    def _error(self, fault: str, of_object: bool = True) -> PhysicsError:
        remedy = "If other trials of this robot end so too, change its files."
        if of_object:
            remedy = (
                "If the problem places objects inside each other or inside the table, move them apart: `position` is "
                "an object's middle, and the table top is at "
                f"z = {self._world.workspace.support_z_m:g} m. `torc problems validate` names the two that are deepest."
            )
        return PhysicsError(f"{fault} at t = {self._world.time_s:.3f} s. The trial does not count. {remedy}")


def greatest_depth(model: mujoco.MjModel, data: mujoco.MjData, geoms: Int[np.ndarray, "2"]) -> float:
    """Return an upper bound, in metres, on how deep two geoms are inside each other.

    Moving one by this much separates the boxes around them, along their own axes (separating axes of two boxes).
    """
    a, b = (data.geom_xmat[g].reshape(3, 3) for g in geoms)
    across = np.cross(a.T[:, None], b.T[None]).reshape(-1, 3)
    across = across[np.linalg.norm(across, axis=1) > _PARALLEL]
    axes = np.concatenate([a.T, b.T, across / np.linalg.norm(across, axis=1, keepdims=True)])
    half = sum(np.abs(axes @ T) @ model.geom_aabb[g, 3:] for g, T in zip(geoms, (a, b), strict=True))
    middles = [data.geom_xpos[g] + T @ model.geom_aabb[g, :3] for g, T in zip(geoms, (a, b), strict=True)]
    return float((half - np.abs(axes @ (middles[1] - middles[0]))).min())


def _may_fall(world: World) -> Bool[np.ndarray, "n"]:
    """Return which objects are where falling is normal: below the table top, or above the bin."""
    p, bin_ = world.positions, world.workspace.bin
    over_bin = np.abs(p[:, :2] - bin_.center[:2]) <= 0.5 * np.array(bin_.inner_size[:2]) + bin_.wall_m
    return np.asarray((p[:, 2] < world.workspace.support_z_m - 0.02) | over_bin.all(axis=1))
