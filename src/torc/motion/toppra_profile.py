"""The speed profile by the toppra library: the same problem as `profile`, kept as a second opinion.

Its import takes seconds (it loads matplotlib's user interface) and each path milliseconds, so it is an extra.
"""

import logging
import warnings

import numpy as np
from jaxtyping import Float

from torc.errors import MissingDependencyError, extra_remedy
from torc.motion.geometry import PiecewisePath

try:
    with warnings.catch_warnings():
        # Some of its docstrings have invalid escapes: Python says so when it first compiles them.
        warnings.simplefilter("ignore")
        import toppra
        from toppra.interpolator import AbstractGeometricPath
except ImportError as error:
    raise MissingDependencyError(
        "The timing backend 'toppra' (x86-64 only)", extra_remedy("toppra")
    ) from error


class _ToppraPath(AbstractGeometricPath):
    """A PiecewisePath in the form toppra wants."""

    def __init__(self, path: PiecewisePath) -> None:
        self.path = path

    def __call__(self, path_positions: np.ndarray, order: int = 0) -> np.ndarray:
        values = self.path(np.atleast_1d(path_positions), order)
        return values if np.ndim(path_positions) else values[0]

    @property
    def dof(self) -> int:
        return self.path.points.shape[1]

    @property
    def path_interval(self) -> np.ndarray:
        return np.array([0.0, self.path.length])


def toppra_speeds(
    path: PiecewisePath,
    grid: Float[np.ndarray, "m"],
    max_speed: Float[np.ndarray, "dof"],
    max_acceleration: Float[np.ndarray, "dof"],
) -> Float[np.ndarray, "m"] | None:
    """Path speed at each grid point, or None where the solver finds none."""
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.stack([-max_speed, max_speed], axis=1)),
        toppra.constraint.JointAccelerationConstraint(
            np.stack([-max_acceleration, max_acceleration], axis=1)
        ),
    ]
    logging.getLogger("toppra").setLevel(logging.ERROR)
    solver = toppra.algorithm.TOPPRA(constraints, _ToppraPath(path), gridpoints=grid, solver_wrapper="seidel")
    _, speeds, _ = solver.compute_parameterization(0.0, 0.0)
    return None if speeds is None or not np.all(np.isfinite(speeds)) else np.maximum(speeds, 0.0)
