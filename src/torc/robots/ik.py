"""Inverse kinematics: every branch of many poses at once.

Arms with the spherical-revolute-spherical structure are solved in closed form; any other by damped least squares
from a fixed set of starts. Which of the two is decided from the description alone.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from torc.errors import InputError
from torc.geometry.arrays import kernel_array
from torc.robots.description import ArmDescription
from torc.robots.ik_numeric import numeric_ik_kernel, start_configurations
from torc.robots.ik_srs import SrsStructure, detect_srs, srs_ik_kernel

CHUNK = 512
"""Poses per kernel call; bounds the memory for all their branches."""


@dataclass(frozen=True)
class IkConfig:
    """How inverse kinematics is solved.

    Attributes:
        swivel_angles: elbow positions tried per pose, evenly around the circle (closed form). More find tighter gaps
            in clutter and take longer in proportion.
        soft_margin_rad: solutions whose joints are closer than this to a limit are ranked lower, by up to
            `limit_weight` per joint, in units of squared radians from rest.
        starts: numerical solver: starting configurations per pose.
        tolerance: numerical solver: largest error of a solution, metres and radians.
    """

    swivel_angles: int = 16
    max_branches: int = 192
    soft_margin_rad: float = 0.2
    limit_weight: float = 4.0
    starts: int = 32
    iterations: int = 60
    tolerance: float = 1e-8


@dataclass(frozen=True)
class IkSolutions:
    """Solutions per pose, best first: joint positions, radians, NaN beyond the count, which is 0 where a pose cannot be
    reached.
    """

    qpos: Float[np.ndarray, "n b dof"]
    count: Int[np.ndarray, "n"]

    def of(self, i: int) -> Float[np.ndarray, "m dof"]:
        """The solutions of pose i."""
        return self.qpos[i, : self.count[i]]


def solve_ik(
    arm: ArmDescription, Ts_world_tool0: Float[np.ndarray, "n 4 4"], config: IkConfig | None = None
) -> IkSolutions:
    """All solutions found for each pose of the flange, within the joint limits, angles 2 pi apart included, by distance
    from the rest configuration with a penalty near joint limits. Raises InputError if a pose is not a rigid transform.
    """
    config = config or IkConfig()
    Ts = kernel_array(Ts_world_tool0)
    _check_poses(Ts)
    structure = detect_srs(arm)
    parts = [_solve(arm, structure, Ts[i : i + CHUNK], config) for i in range(0, len(Ts), CHUNK)]
    widest = max([1, *[p.qpos.shape[1] for p in parts]])
    qpos = np.full((len(Ts), widest, arm.dof), np.nan)
    for i, part in zip(range(0, len(Ts), CHUNK), parts):
        qpos[i : i + CHUNK, : part.qpos.shape[1]] = part.qpos
    return IkSolutions(qpos, np.concatenate([np.zeros(0, dtype=np.int64), *[p.count for p in parts]]))


def _check_poses(Ts: np.ndarray) -> None:
    if Ts.ndim != 3 or Ts.shape[1:] != (4, 4):
        raise InputError(f"Poses must be (n, 4, 4); they are {Ts.shape}.")
    R = Ts[:, :3, :3]
    error = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = ~((error < 1e-6) & (np.linalg.det(R) > 0) & np.isfinite(Ts).all(axis=(1, 2)))
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        raise InputError(f"Pose {first} is not a rigid transform; normalise its rotation.")


def _solve(
    arm: ArmDescription, structure: SrsStructure | None, Ts: np.ndarray, config: IkConfig
) -> IkSolutions:
    qpos = np.full((len(Ts), config.max_branches, arm.dof), np.nan)
    count = np.zeros(len(Ts), dtype=np.int64)
    ranking = (arm.lower, arm.upper, arm.rest_qpos, config.soft_margin_rad, config.limit_weight)
    if structure is not None:
        srs_ik_kernel(Ts, structure, config.swivel_angles, *ranking, qpos, count)
    else:
        chain = (arm.T_world_base, arm.Ts_parent_joint, arm.axes, arm.T_last_tool0)
        starts = start_configurations(arm, config.starts)
        numeric_ik_kernel(Ts, chain, starts, config.iterations, config.tolerance, *ranking, qpos, count)
    return IkSolutions(qpos[:, : max(1, int(count.max(initial=0)))], count)
