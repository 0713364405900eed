"""Which objects stand around a target, as far as the paper's pruning rule asks.

"For each target, all objects (1) directly in front of it, (2) within 15 cm to the left or right, and (3) taller than
the target were recorded. If any of these objects possessed no ground-truth grasps that were both collision-free (with
the static scene) and IK-feasible, the corresponding TORC problem was excluded." (Simulated Dataset, step 4)

Here an object is recorded if it is any of the three, seen from the camera:

- in front: nearer to the camera, and the two overlap in the camera's azimuth;
- beside: at most 15 cm away across the line of sight, and the two overlap along it;
- taller: its highest point is above the target's, and the horizontal gap is at most 15 cm too.
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
    """Names of the objects around a target, in the problem's order; an object may be in several groups."""

    in_front: tuple[str, ...]
    beside: tuple[str, ...]
    taller: tuple[str, ...]

    @property
    def all(self) -> tuple[str, ...]:
        """All of them, each once."""
        return tuple(dict.fromkeys((*self.in_front, *self.beside, *self.taller)))


def surroundings(problem: Problem, target: str, T_world_camera: Pose) -> Surroundings:
    """The objects around a target, seen from the robot's camera. Raises UnknownNameError for an unknown target."""
    placements = {o.name: o for o in problem.objects}
    if target not in placements:
        raise UnknownNameError("object", target, list(placements))
    eye = T_world_camera[:2, 3]
    sight = np.asarray(placements[target].position[:2]) - eye
    sight = sight / max(float(np.linalg.norm(sight)), 1e-9)
    extents = {name: _extent(o, eye, sight) for name, o in placements.items()}
    own = extents.pop(target)
    in_front, beside, taller = [], [], []
    for name, extent in extents.items():
        # Distances between two objects' intervals; negative where they overlap.
        azimuth, along, across, _ = np.maximum(extent[:, 0] - own[:, 1], own[:, 0] - extent[:, 1])
        if extent[1, 0] < own[1, 0] and azimuth < 0:
            in_front.append(name)
        if along < 0 and across <= BESIDE_M:
            beside.append(name)
        if extent[3, 1] > own[3, 1] and np.hypot(max(along, 0.0), max(across, 0.0)) <= BESIDE_M:
            taller.append(name)
    return Surroundings(tuple(in_front), tuple(beside), tuple(taller))


def _extent(
    placement: ObjectPlacement, eye: Float[np.ndarray, "2"], sight: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "4 2"]:
    """Least and largest azimuth, distance along and across a line of sight, and height, seen from the camera."""
    points, _ = placed(*surface_cloud(load_object(placement.model)), placement.T_world_object)
    offset = points[:, :2] - eye
    along, across = offset @ sight, offset @ np.array([-sight[1], sight[0]])
    values = np.stack([np.arctan2(across, along), along, across, points[:, 2]])
    return np.stack([values.min(axis=1), values.max(axis=1)], axis=1)
