"""Detect that a simulation broke: a trial on broken physics is errored, never scored."""

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from torc.errors import PhysicsError
from torc.sim.simulated_world import World

_BAD_NUMBERS = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)
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


class Watchdog:
    """Checks a world; a few dozen times per simulated second are enough."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.deep_since_s: float | None = None
        """Since when two bodies have been too deep in each other; None if they are not."""

    def check(self) -> None:
        """Check once. Raises PhysicsError for NaN, a body too fast, or two bodies too deep in each other."""
        data = self._world.data
        if any(data.warning[int(w)].number for w in _BAD_NUMBERS) or not np.isfinite(data.qpos).all():
            raise PhysicsError(
                f"The simulation diverged at t = {data.time:.3f} s (NaN or huge numbers). {self._remedy()}"
            )
        self._check_penetration()  # first: it names what is inside what, even if that made things fly
        self._check_speeds()

    def _check_penetration(self) -> None:
        world, contact = self._world, self._world.data.contact
        depths = self._depths()
        if depths.max(initial=0.0) <= _MAX_PENETRATION_M:
            self.deep_since_s = None
            return
        deepest = int(np.argmax(depths))
        # A restored state may set time back.
        since = world.time_s if self.deep_since_s is None else min(self.deep_since_s, world.time_s)
        self.deep_since_s = since
        if depths[deepest] > _MAX_IMPACT_PENETRATION_M or world.time_s - since >= _PENETRATION_S:
            a, b = (world.body_name_of_geom(g) for g in contact.geom[deepest])
            raise PhysicsError(
                f"{a} and {b} are {1000 * depths[deepest]:.0f} mm inside each other at t = {world.time_s:.3f} s. "
                f"{self._remedy(contact.geom[deepest])}"
            )

    def _depths(self) -> Float[np.ndarray, "n"]:
        """Return how deep the two bodies of each contact are in each other."""
        world, contact = self._world, self._world.data.contact
        # Below the table, in the bin and on the floor, things land hard and sink in; that is harmless.
        below = contact.pos[:, 2] < world.workspace.support_z_m - _BELOW_M
        depths = np.where(below, 0.0, -contact.dist)
        # MuJoCo occasionally errs about thin pieces for an instant: a plate and a spatula that touch are 80 mm inside
        # each
        # other.
        for i in np.flatnonzero(depths > _MAX_PENETRATION_M):
            depths[i] = min(depths[i], greatest_depth(world.model, world.data, contact.geom[i]))
        return depths

    def _check_speeds(self) -> None:
        world = self._world
        speeds = np.where(world.present, np.linalg.norm(world.velocities[:, :3], axis=1), 0.0)
        if speeds.max(initial=0.0) > _MAX_SPEED_M_S:
            limits = np.where(_may_fall(world), _MAX_FALLING_SPEED_M_S, _MAX_SPEED_M_S)
            worst = int(np.argmax(speeds - limits))
            if speeds[worst] > limits[worst]:
                name = world.problem.ordered()[worst].name
                raise PhysicsError(
                    f"Object {worst} ({name}) moves at {speeds[worst]:.1f} m/s at t = {world.time_s:.3f} s. "
                    f"{self._remedy()}"
                )
        joints = np.abs(world.data.qvel[world.robot_dofs])
        if joints.max(initial=0.0) > _MAX_JOINT_SPEED_RAD_S:
            raise PhysicsError(
                f"A robot joint turns at {joints.max():.0f} rad/s at t = {world.time_s:.3f} s. {self._remedy()}"
            )

    def _remedy(self, geoms: Int[np.ndarray, "2"] | None = None) -> str:
        """Return a remedy; `geoms` are inside each other, if that is the fault."""
        if geoms is not None and not (self._world.geom_labels[geoms] >= 0).any():
            return "The trial does not count. If other trials of this robot end so too, change its files."
        return (
            "The trial does not count. If the problem places objects inside each other or inside the table, move them "
            "apart: `position` is an object's middle, and the table top is at "
            f"z = {self._world.workspace.support_z_m:g} m. `torc problems validate` names the two that are deepest."
        )


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
