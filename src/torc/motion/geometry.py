"""Paths of straight pieces and quadratic arcs: exactly the checked path, with its derivatives."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class PiecewisePath:
    """q(s) = points + tangents * t + curvatures * t^2 / 2, with t = s - starts, on each piece.

    The parameter s is arc length on straight pieces and passes corners at the same speed, so the tangent is continuous
    wherever a corner is rounded.

    Attributes:
        starts: value of s at which each piece begins, and finally the end of the path.
        points, tangents, curvatures: q, q' and q'' at the start of each piece.
    """

    starts: Float[np.ndarray, "p_plus_1"]
    points: Float[np.ndarray, "p dof"]
    tangents: Float[np.ndarray, "p dof"]
    curvatures: Float[np.ndarray, "p dof"]

    @property
    def length(self) -> float:
        """The last value of s."""
        return float(self.starts[-1])

    def __call__(self, s: Float[np.ndarray, "n"], order: int = 0) -> Float[np.ndarray, "n dof"]:
        """Return q, or its first or second derivative by s."""
        piece = np.clip(np.searchsorted(self.starts, s, side="right") - 1, 0, len(self.points) - 1)
        t = (np.asarray(s) - self.starts[piece])[:, None]
        if order == 0:
            return self.points[piece] + self.tangents[piece] * t + self.curvatures[piece] * (0.5 * t * t)
        if order == 1:
            return self.tangents[piece] + self.curvatures[piece] * t
        return self.curvatures[piece]

    def grid(self, spacing: float, per_arc: int = 8) -> Float[np.ndarray, "g"]:
        """Return values of s from end to end that contain every piece's ends, evenly between them."""
        parts = []
        for a, b, curvature in zip(self.starts[:-1], self.starts[1:], self.curvatures):
            n = max(per_arc if np.any(curvature) else 2, int(np.ceil((b - a) / spacing)))
            parts.append(np.linspace(a, b, n, endpoint=False))
        return np.append(np.concatenate(parts), self.length)


def rounded_path(path: Float[np.ndarray, "m dof"], blends: Float[np.ndarray, "m"]) -> list[PiecewisePath]:
    """Return the polyline with each corner k rounded from blends[k] before it to blends[k] after it.

    At a corner that is not rounded (blends[k] = 0) the path has to stop, and is cut. Repeated points are left out.
    """
    parts: list[PiecewisePath] = []
    pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    starts, here = [0.0], path[0]
    for k in range(1, len(path)):
        leg = path[k] - path[k - 1]
        norm = np.linalg.norm(leg)
        if norm < 1e-9:
            continue
        unit = leg / norm
        end = path[k] - unit * blends[k]
        straight = float((end - here) @ unit)
        if straight > 1e-9:
            pieces.append((here, unit, np.zeros_like(unit)))
            starts.append(starts[-1] + straight)
        here = end
        if k < len(path) - 1 and blends[k] > 0:
            following = path[k + 1] - path[k]
            following = following / np.linalg.norm(following)
            pieces.append((here, unit, (following - unit) / (2 * blends[k])))
            starts.append(starts[-1] + 2 * blends[k])
            here = path[k] + following * blends[k]
        elif pieces:
            parts.append(PiecewisePath(np.array(starts), *map(np.array, zip(*pieces))))
            pieces, starts, here = [], [0.0], path[k]
    return parts
