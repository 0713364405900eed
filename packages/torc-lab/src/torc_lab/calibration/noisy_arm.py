"""Estimate the poses of camera and board from flange poses that have errors themselves.

An error of the flange moves all corners of a picture together, so pixels alone mislead: an arm that turns the board by
a quarter of a degree looks like a board of another size. Here each flange pose has an error of its own, and the size of
these errors is estimated too. In each view the flange's error is the difference between the pose that it reports and
the pose at which the picture shows it; its covariance is that of the picture plus that of the arm. The likelihood is
Student's t in six dimensions, so that a bad view hardly counts.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, invert, make_pose

Mounting = Literal["fixed", "hand"]
"""The camera is fixed, with the board in the hand; or it is in the hand, with the board fixed."""
_FREEDOM = 5.0
"""Degrees of freedom of Student's t: about 5 % less exact than least squares if no view is bad."""
_ROUNDS, _SETTLED = 30, 1e-7
_STEPS, _STEADY_LOG = 3, 0.01
"""Steps per round, as transforms need not settle before the noise has; the noise settles within a hundredth."""
_DIFFERENCE = 1e-6
_LEAST_RAD, _LEAST_M = 1e-6, 1e-6
_MOST_RAD, _MOST_M = 0.1, 0.1
_GAUSSIAN = 1.12
"""Width of a normal distribution over that of the t of five degrees that fits it best in six dimensions."""


@dataclass(frozen=True)
class PoseView:
    """The board's pose in one picture, and the flange's pose as the arm reports it.

    Attributes:
        covariance: of the board's pose, in the board's frame: turn (rad), then shift (m).
    """

    T_base_flange: Pose
    T_camera_board: Pose
    covariance: Float[np.ndarray, "6 6"]


@dataclass(frozen=True)
class ArmNoise:
    """Standard deviations of the flange's errors, about and along each axis."""

    axis_rad: float
    axis_m: float

    @property
    def turn_rad(self) -> float:
        """Root mean square of the whole turn."""
        return float(np.sqrt(3)) * self.axis_rad

    @property
    def shift_m(self) -> float:
        """Root mean square of the whole shift."""
        return float(np.sqrt(3)) * self.axis_m


@dataclass(frozen=True)
class PoseFit:
    """Both transforms, the arm's noise, and the best-fitting scale of the board.

    Attributes:
        scale, scale_error: of the board relative to its stated size, and its standard error.
    """

    T_camera: Pose
    T_board: Pose
    noise: ArmNoise
    scale: float
    scale_error: float


def fit_poses(views: Sequence[PoseView], mounting: Mounting) -> PoseFit:
    """Estimate both transforms and the arm's noise by maximum likelihood."""
    stack = _Stack(views, mounting)
    first = park([(v.T_base_flange, v.T_camera_board) for v in views], mounting == "hand")
    numbers, sigmas = _alternate(stack, _numbers(first), np.log([1e-3, 1e-3]))
    with_scale, _ = _alternate(stack, np.append(numbers, 0.0), sigmas)
    noise = ArmNoise(*map(float, _GAUSSIAN * np.exp(sigmas)))
    T_camera, T_board = _transforms(numbers)
    J = _slope(stack, with_scale, _whitening(stack, with_scale, sigmas))
    error = _GAUSSIAN * np.sqrt(np.linalg.pinv(J.T @ J)[12, 12])
    return PoseFit(T_camera, T_board, noise, float(np.exp(with_scale[12])), float(error))


def refit(views: Sequence[PoseView], mounting: Mounting, begin: PoseFit) -> tuple[Pose, Pose]:
    """Estimate both transforms from some of the views, with the arm's noise known from `begin`."""
    numbers = _numbers((begin.T_camera, begin.T_board))
    sigmas = np.log([begin.noise.axis_rad / _GAUSSIAN, begin.noise.axis_m / _GAUSSIAN])
    return _transforms(_reweighted(_Stack(views, mounting), numbers, sigmas, _ROUNDS))


def park(pairs: Sequence[tuple[Pose, Pose]], on_hand: bool) -> tuple[Pose, Pose]:
    """Return a first guess of camera and board, solving for the rotations first (Park & Martin 1994).

    Args:
        pairs: T_base_flange and T_camera_board, per picture.
        on_hand: whether the camera is on the hand.

    Returns:
        Camera in the flange and board in the base if the camera is on the hand; else camera in the base and board in
            the flange.
    """
    seen = [T for _, T in pairs]
    flanges = [T if on_hand else invert(T) for T, _ in pairs]
    # The camera X has flange_i X seen_i the same for all i.
    moves = [
        (invert(flanges[j]) @ flanges[i], seen[j] @ invert(seen[i]))
        for i, j in itertools.combinations(range(len(seen)), 2)
    ]
    of_flange, of_board = (Rotation.from_matrix([m[k][:3, :3] for m in moves]).as_rotvec() for k in (0, 1))
    R = Rotation.align_vectors(of_flange, of_board)[0].as_matrix()
    left = np.concatenate([A[:3, :3] - np.eye(3) for A, _ in moves])
    right = np.concatenate([R @ B[:3, 3] - A[:3, 3] for A, B in moves])
    T_camera = make_pose(R, np.linalg.lstsq(left, right, rcond=None)[0])
    boards = [F @ T_camera @ T for F, T in zip(flanges, seen, strict=True)]
    R_board = Rotation.from_matrix([T[:3, :3] for T in boards]).mean().as_matrix()
    return T_camera, make_pose(R_board, np.median([T[:3, 3] for T in boards], axis=0))


def crossing(t: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "v 3 3"]:
    """Return for each t the matrix M with M @ x = cross(t, x)."""
    return np.cross(np.eye(3), t[:, None])


def _transforms(numbers: Float[np.ndarray, "n"]) -> tuple[Pose, Pose]:
    """Return camera and board from twelve numbers: rotation vector and position of each."""
    first, second = (
        make_pose(Rotation.from_rotvec(v[:3]).as_matrix(), v[3:]) for v in (numbers[:6], numbers[6:12])
    )
    return first, second


def _numbers(poses: tuple[Pose, Pose]) -> Float[np.ndarray, "12"]:
    return np.concatenate([[*Rotation.from_matrix(T[:3, :3]).as_rotvec(), *T[:3, 3]] for T in poses])


class _Stack:
    """All views as arrays."""

    def __init__(self, views: Sequence[PoseView], mounting: Mounting) -> None:
        self.flanges_inverse = invert(np.stack([v.T_base_flange for v in views]))
        self.seen = np.stack([v.T_camera_board for v in views])
        self.covariances = np.stack([v.covariance for v in views])
        self.mounting = mounting

    def errors(self, numbers: np.ndarray) -> Float[np.ndarray, "v 6"]:
        """Return the flange's error per view: turn and shift in its own frame."""
        T_camera, T_board = _transforms(numbers)
        seen = self._scaled(numbers)
        if self.mounting == "fixed":
            shown = T_camera @ seen @ invert(T_board)
        else:
            shown = T_board @ invert(seen) @ invert(T_camera)
        off = self.flanges_inverse @ shown
        return np.hstack([Rotation.from_matrix(off[:, :3, :3]).as_rotvec(), off[:, :3, 3]])

    def spread(self, numbers: np.ndarray, sigmas: np.ndarray) -> Float[np.ndarray, "v 6 6"]:
        """Return the covariance of those errors: the picture's, carried to the flange, plus the arm's."""
        T_camera, T_board = _transforms(numbers)
        if self.mounting == "fixed":
            carried = np.broadcast_to(T_board, self.seen.shape)
        else:
            carried = T_camera @ self._scaled(numbers)
        R, t = carried[:, :3, :3], carried[:, :3, 3]
        adjoint = np.zeros((len(R), 6, 6))
        adjoint[:, :3, :3] = adjoint[:, 3:, 3:] = R
        adjoint[:, 3:, :3] = crossing(t) @ R
        arm = np.diag(np.repeat(np.exp(2 * sigmas), 3))
        return np.asarray(adjoint @ self.covariances @ adjoint.transpose(0, 2, 1) + arm)

    def _scaled(self, numbers: np.ndarray) -> Float[np.ndarray, "v 4 4"]:
        """Return the board's poses, scaled by the exponential of the thirteenth number if there is one."""
        if len(numbers) == 12:
            return self.seen
        seen = self.seen.copy()
        seen[:, :3, 3] *= np.exp(numbers[12])
        return seen


def _alternate(stack: _Stack, numbers: np.ndarray, sigmas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Improve transforms and noise in turn, until they settle."""
    for _ in range(_ROUNDS):
        before = sigmas
        sigmas = _noise_by_likelihood(stack, numbers, sigmas)
        numbers = _reweighted(stack, numbers, sigmas, _STEPS)
        if np.abs(sigmas - before).max() < _STEADY_LOG:
            break
    return _reweighted(stack, numbers, sigmas, _ROUNDS), sigmas


def _reweighted(stack: _Stack, numbers: np.ndarray, sigmas: np.ndarray, steps: int) -> np.ndarray:
    """Return the numbers of largest likelihood for this noise: Gauss-Newton steps, each reweighted."""
    for _ in range(steps):
        white = _whitening(stack, numbers, sigmas)
        step = np.linalg.lstsq(_slope(stack, numbers, white), -_white(stack, numbers, white), rcond=None)[0]
        numbers = numbers + step
        if np.abs(step).max() < _SETTLED:
            break
    return numbers


def _slope(stack: _Stack, numbers: np.ndarray, white: np.ndarray) -> Float[np.ndarray, "m n"]:
    """Return how the whitened errors change with each number, by central differences."""
    shifts = _DIFFERENCE * np.eye(len(numbers))
    columns = [_white(stack, numbers + d, white) - _white(stack, numbers - d, white) for d in shifts]
    return np.column_stack(columns) / (2 * _DIFFERENCE)


def _whitening(stack: _Stack, numbers: np.ndarray, sigmas: np.ndarray) -> Float[np.ndarray, "v 6 6"]:
    """Return per view the matrix that whitens its error, times the root of its weight."""
    inverse = np.linalg.inv(stack.spread(numbers, sigmas))
    errors = stack.errors(numbers)
    squared = np.einsum("vi,vij,vj->v", errors, inverse, errors)
    weights = (_FREEDOM + 6) / (_FREEDOM + squared)
    return np.asarray(np.sqrt(weights)[:, None, None] * np.linalg.cholesky(inverse).transpose(0, 2, 1))


def _white(stack: _Stack, numbers: np.ndarray, white: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("vij,vj->vi", white, stack.errors(numbers)).ravel())


def _noise_by_likelihood(stack: _Stack, numbers: np.ndarray, sigmas: np.ndarray) -> np.ndarray:
    """Return logarithms of the arm's standard deviations, by Student's t."""
    errors = stack.errors(numbers)

    def cost(x: np.ndarray) -> float:
        spread = stack.spread(numbers, x)
        squared = np.einsum("vi,vi->v", errors, np.linalg.solve(spread, errors[..., None])[..., 0])
        each = np.linalg.slogdet(spread)[1] + (_FREEDOM + 6) * np.log1p(squared / _FREEDOM)
        return float(each.sum())

    bounds = [(np.log(_LEAST_RAD), np.log(_MOST_RAD)), (np.log(_LEAST_M), np.log(_MOST_M))]
    search = {"xatol": 0.003, "fatol": 1e-4}
    return np.asarray(minimize(cost, sigmas, method="Nelder-Mead", bounds=bounds, options=search).x)
