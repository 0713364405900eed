"""Which objects stand around a target, as far as the paper's pruning rule asks.

"For each target, all objects (1) directly in front of it, (2) within 15 cm to the left or right, and (3) taller than
the target were recorded. If any of these objects possessed no ground-truth grasps that were both collision-free (with
the static scene) and IK-feasible, the corresponding TORC problem was excluded." (Simulated Dataset, step 4)

How that is read here:

- "all objects (1), (2), and (3)" is a list: an object is recorded if it is any of the three. Read as "all three at
  once" the rule would let pass a blocker in front that is lower than the target, or a taller one beside it.
- Directions are the robot's: "in front" is towards the camera, "left and right" across the line of sight.
- (1) An object is directly in front if it is nearer to the camera, and the two overlap in the camera's azimuth: it is
  in the way of the eye, and of an arm that comes from there.
- (2) An object is beside if the gap across the line of sight is at most 15 cm, and the two overlap along it.
- (3) "Taller" without a place would take in the far end of the table, where nothing can be in the way. An object
  counts as taller if its highest point is above the target's and the horizontal gap between the two is at most the
  same 15 cm. What lies on the target is taller, too.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.errors import UnknownNameError
from torc.generation.surfaces import placed, surface_cloud
from torc.geometry.transforms import Pose
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem

BESIDE_M = 0.15
"""The paper's distance to the left or right."""


@dataclass(frozen=True)
class Surroundings:
    """Names of the objects around a target, in the problem's order.

    Attributes:
        in_front, beside, taller: see the module's text; an object may be in several.
    """

    in_front: tuple[str, ...]
    beside: tuple[str, ...]
    taller: tuple[str, ...]

    @property
    def all(self) -> tuple[str, ...]:
        """All of them, each once."""
        return tuple(dict.fromkeys((*self.in_front, *self.beside, *self.taller)))


@dataclass(frozen=True)
class _Extent:
    """How far an object reaches, seen from the camera: azimuth, distance along and across a line of sight, height."""

    azimuth: tuple[float, float]
    along: tuple[float, float]
    across: tuple[float, float]
    top_m: float


def surroundings(
    problem: Problem, target: str, T_world_camera: Pose, beside_m: float = BESIDE_M
) -> Surroundings:
    """The objects around a target, seen from the robot's camera. Raises UnknownNameError for an unknown target."""
    placements = {o.name: o for o in problem.objects}
    if target not in placements:
        raise UnknownNameError("object", target, list(placements))
    eye = T_world_camera[:2, 3]
    sight = np.asarray(placements[target].position[:2]) - eye
    sight = sight / max(float(np.linalg.norm(sight)), 1e-9)
    extents = {name: _extent(o, eye, sight) for name, o in placements.items()}
    own = extents.pop(target)
    return Surroundings(
        in_front=tuple(n for n, e in extents.items() if _in_front(e, own)),
        beside=tuple(n for n, e in extents.items() if _beside(e, own, beside_m)),
        taller=tuple(n for n, e in extents.items() if _taller(e, own, beside_m)),
    )


def _in_front(other: _Extent, target: _Extent) -> bool:
    return other.along[0] < target.along[0] and _gap(other.azimuth, target.azimuth) < 0


def _beside(other: _Extent, target: _Extent, beside_m: float) -> bool:
    return _gap(other.along, target.along) < 0 and _gap(other.across, target.across) <= beside_m


def _taller(other: _Extent, target: _Extent, beside_m: float) -> bool:
    gaps = [max(_gap(other.along, target.along), 0.0), max(_gap(other.across, target.across), 0.0)]
    return other.top_m > target.top_m and bool(np.hypot(gaps[0], gaps[1]) <= beside_m)


def _gap(a: tuple[float, float], b: tuple[float, float]) -> float:
    """Distance between two intervals; negative where they overlap."""
    return max(a[0] - b[1], b[0] - a[1])


def _extent(
    placement: ObjectPlacement, eye: Float[np.ndarray, "2"], sight: Float[np.ndarray, "2"]
) -> _Extent:
    points, _ = placed(*surface_cloud(load_object(placement.model)), placement.T_world_object)
    offset = points[:, :2] - eye
    across = np.array([-sight[1], sight[0]])
    along, sideways = offset @ sight, offset @ across
    return _Extent(
        _range(np.arctan2(sideways, along)), _range(along), _range(sideways), float(points[:, 2].max())
    )


def _range(values: Float[np.ndarray, "n"]) -> tuple[float, float]:
    return float(values.min()), float(values.max())
