"""Unstructured scenes to start a problem from: objects that hang above the table, to be let fall between walls.

The poses are not settled: the simulator lets them come to rest. World frame, metres.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from torc.generation.sampling import placement_names
from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement


@dataclass(frozen=True)
class DropConfig:
    """A heap dropped between temporary walls.

    Attributes:
        center, size: of the rectangle between the walls.
        support_z_m: height of the table top.
        lowest_m: free height under the lowest object.
        gap_m: free distance between the objects' bounding spheres.
        candidates: positions tried per object; the lowest free one is taken.
    """

    center: tuple[float, float] = (0.65, -0.115)
    size: tuple[float, float] = (0.42, 0.46)
    support_z_m: float = 1.05
    lowest_m: float = 0.02
    gap_m: float = 0.005
    candidates: int = 24


def drop_arrangement(
    names: Sequence[str], rng: np.random.Generator, config: DropConfig | None = None
) -> list[ObjectPlacement]:
    """Objects in random orientations, hanging above the table at staggered heights, in the order of `names`.

    No two overlap (bounding spheres), so the simulator can let all of them fall at once between walls around the
    rectangle. Raises UnknownNameError for an unknown model.
    """
    config = config or DropConfig()
    models = [load_object(name) for name in names]
    radii = np.array([bounding_radius(m) for m in models])
    positions = np.zeros((len(models), 3))
    placed: list[int] = []
    for i in rng.permutation(len(models)):
        positions[i] = _lowest_free(float(radii[i]), positions[placed], radii[placed], rng, config)
        placed.append(int(i))
    placements = []
    for name, model, position in zip(placement_names(names), models, positions):
        x, y, z = (float(v) for v in position)
        placements.append(ObjectPlacement(name, model.name, (x, y, z), _random_wxyz(rng)))
    return placements


def bounding_radius(model: ObjectModel) -> float:
    """Radius of a sphere about the model's origin that holds all its pieces."""
    corners = np.array(np.meshgrid(*[(0, 1)] * 3)).reshape(3, -1).T
    return max(
        float(np.linalg.norm(piece.bounds[corners, np.arange(3)], axis=1).max()) for piece in model.pieces
    )


def _lowest_free(
    radius: float, centers: np.ndarray, radii: np.ndarray, rng: np.random.Generator, config: DropConfig
) -> np.ndarray:
    """The lowest of some random positions at which a sphere touches none of the others."""
    half = np.maximum(np.array(config.size) / 2 - radius, 0.0)
    xy = np.array(config.center) + rng.uniform(-1, 1, (config.candidates, 2)) * half
    z = np.full(len(xy), config.support_z_m + config.lowest_m + radius)
    if len(centers):
        reach = radius + radii + config.gap_m
        over2 = reach**2 - ((xy[:, None] - centers[None, :, :2]) ** 2).sum(axis=2)
        above = np.where(over2 > 0, centers[None, :, 2] + np.sqrt(np.maximum(over2, 0)), -np.inf)
        z = np.maximum(z, above.max(axis=1))
    k = int(np.argmin(z))
    return np.array([xy[k, 0], xy[k, 1], z[k]])


def _random_wxyz(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """A uniformly random orientation."""
    q = rng.normal(size=4)
    w, x, y, z = (float(v) for v in q / np.linalg.norm(q))
    return w, x, y, z
