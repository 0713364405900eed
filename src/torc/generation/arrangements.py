"""Initial scenes of problems: objects that stand tightly packed, or hang above the table before they are dropped.

The poses are not settled: the simulator lets them come to rest. World frame, metres.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.generation.footprints import (
    DIRECTIONS,
    LIE_ON_BACK,
    Footprint,
    directions,
    fits_on,
    footprint,
    gaps,
)
from torc.generation.sampling import Rectangle, lanes, placement_names
from torc.geometry.transforms import rotation_about
from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement

DROP_CENTER, DROP_SIZE = (0.65, -0.115), (0.42, 0.46)
"""The rectangle over which objects hang before they are dropped."""
DROP_FROM_Z_M = 1.05 + 0.02
"""Height of the lowest point of the lowest object."""
DROP_GAP_M = 0.005
"""Free distance between the bounding spheres of hanging objects."""
_LEANS_FROM = 2.0
"""Height over thickness of what may be tilted ..."""
_TILT_RAD = float(np.deg2rad(14))
"""... by this."""
_DROP_CANDIDATES = 24
"""Positions tried per hanging object; the lowest free one is taken."""


@dataclass(frozen=True)
class StructuredConfig:
    """Standing clutter.

    Attributes:
        region: ((x0, x1), (y0, y1)) of the objects' origins; footprints may stick out by margin_m.
        margin_m: see region.
        support_z_m: height of the table top, above which objects start clearance_m high.
        clearance_m: see support_z_m.
        gap_m: wanted smallest and largest gap to the nearest neighbour; the smallest always holds.
        tall_in_front: chance that an object is drawn to the front by its height (the tall hide the short).
        stacked: chance that a thing with a flat base is put on top of another one, where one fits ...
        stacked_height_m: ... if it is no higher than this ...
        storeys: ... and at most this many stand on each other.
        leaning: chance that a high thing is tilted: it leans against what it meets.
        lying: chance that a box lies on its back, if the side that then faces sideways is at most lying_width_m wide.
        lying_width_m: see lying.
        turned_rad: standard deviation of the yaw about facing the robot.
        sideways: chance of another quarter turn.
        sorted: whether things of one sort stand together, in lanes from front to back.
        candidates: poses tried per object.
        restarts: how often the packing starts afresh before it gives up.
    """

    region: Rectangle = ((0.52, 0.78), (-0.33, 0.10))
    margin_m: float = 0.04
    support_z_m: float = 1.05
    clearance_m: float = 0.002
    gap_m: tuple[float, float] = (0.005, 0.025)
    tall_in_front: float = 0.6
    stacked: float = 0.3
    stacked_height_m: float = 0.06
    storeys: int = 2
    leaning: float = 0.0
    lying: float = 0.15
    lying_width_m: float = np.inf
    turned_rad: float = 0.4
    sideways: float = 0.25
    sorted: bool = False
    candidates: int = 240
    restarts: int = 30


def structured_arrangement(
    names: Sequence[str], rng: np.random.Generator, config: StructuredConfig | None = None
) -> list[ObjectPlacement]:
    """Return objects in natural poses, tightly packed, in the order of `names`.

    Raises InputError if they do not fit into the region, UnknownNameError for an unknown model.
    """
    config = config or StructuredConfig()
    models = [load_object(name) for name in names]
    for _ in range(config.restarts):
        packing = _Packing(models, rng, config)
        if packing.run():
            return [packing.placement(i, name) for i, name in enumerate(placement_names(names))]
    (x0, x1), (y0, y1) = config.region
    raise InputError(
        f"{len(names)} objects do not fit into {x1 - x0:.2f} x {y1 - y0:.2f} m after {config.restarts} tries. "
        "Use fewer or smaller objects, or a larger region."
    )


class _Packing:
    """One attempt at a packing: footprints and positions grow object by object."""

    def __init__(self, models: list[ObjectModel], rng: np.random.Generator, config: StructuredConfig) -> None:
        self._models, self._rng, self._config = models, rng, config
        self._regions = lanes(models, config.region, rng) if config.sorted else [config.region] * len(models)
        self._prints: dict[int, Footprint] = {}
        self._positions: dict[int, np.ndarray] = {}
        self._on_table: list[int] = []
        self._storey: dict[int, int] = {}
        """Storey of each thing that may carry another; 1 is on the table."""
        self._carrying: set[int] = set()

    def run(self) -> bool:
        """Place all objects, large ones first, with some luck in the order. Returns False if one finds no place."""
        area = np.array([m.size_m[0] * m.size_m[1] for m in self._models])
        order = np.argsort(-area * self._rng.uniform(0.6, 1.4, len(area)), kind="stable")
        return all(self._stack(int(i)) or self._stand(int(i)) for i in order)

    def placement(self, index: int, name: str) -> ObjectPlacement:
        x, y, z = (float(v) for v in self._positions[index])
        return ObjectPlacement(name, self._models[index].name, (x, y, z), self._prints[index].wxyz)

    def _pose(self, model: ObjectModel) -> Footprint:
        """Draw a natural orientation: upright, tilted or a box on its back, the front roughly towards the robot."""
        config, rng = self._config, self._rng
        is_box = len(model.pieces) == 1 and model.pieces[0].kind == "box"
        lies = is_box and rng.random() < config.lying and min(model.size_m[1:]) <= config.lying_width_m
        yaw = rng.normal(0.0, config.turned_rad) + (np.pi / 2 if rng.random() < config.sideways else 0.0)
        R = rotation_about((0, 0, 1), yaw) @ (LIE_ON_BACK if lies else np.eye(3))
        high = not lies and model.size_m[2] >= _LEANS_FROM * model.size_m[0]
        if config.leaning and high and rng.random() < config.leaning:
            R = R @ rotation_about((0, 1, 0), _TILT_RAD * rng.choice((-1.0, 1.0)))
        return footprint(model, R)

    def _stack(self, index: int) -> bool:
        """Put an object on top of a free flat one, if chance and the sizes allow."""
        config, rng = self._config, self._rng
        if rng.random() >= config.stacked:
            return False
        upper = self._pose(self._models[index])
        if upper.lowest_m + upper.highest_m > config.stacked_height_m or upper.base is None:
            return False
        for below in rng.permutation(list(self._storey)):
            lower, offset = self._prints[int(below)], rng.normal(0.0, 0.006, 2)
            if int(below) not in self._carrying and fits_on(upper, lower, offset, overhang_m=0.008):
                position = self._positions[int(below)].copy()
                position[:2] += offset
                position[2] += lower.highest_m + config.clearance_m + upper.lowest_m
                self._prints[index], self._positions[index] = upper, position
                self._carrying.add(int(below))
                if self._storey[int(below)] + 1 < config.storeys:
                    self._storey[index] = self._storey[int(below)] + 1
                return True
        return False

    def _stand(self, index: int) -> bool:
        """Put an object on the table, next to others."""
        config, rng = self._config, self._rng
        best: tuple[float, Footprint, np.ndarray] | None = None
        x_wanted = None
        if rng.random() < config.tall_in_front:
            # The tallest at the front (small x), the lowest at the back.
            (x0, x1), heights = config.region[0], np.array([m.size_m[2] for m in self._models])
            x_wanted = x0 + (x1 - x0) * float(np.mean(heights > heights[index]))
        for _ in range(6):
            shape = self._pose(self._models[index])
            xy = self._candidates(index, shape, config.candidates // 6)
            nearest = np.full(len(xy), np.inf)
            if self._on_table:
                others = np.array([self._prints[i].extents for i in self._on_table])
                positions = np.array([self._positions[i][:2] for i in self._on_table])
                nearest = gaps(shape.extents, xy, others, positions).min(axis=1)
            xy, nearest = xy[nearest >= config.gap_m[0]], nearest[nearest >= config.gap_m[0]]
            if len(xy) == 0:
                continue
            cost = np.maximum(nearest - config.gap_m[1], 0.0) if self._on_table else np.zeros(len(xy))
            cost += 0.02 * rng.random(len(xy)) if x_wanted is None else 0.3 * np.abs(xy[:, 0] - x_wanted)
            k = int(np.argmin(cost))
            if best is None or cost[k] < best[0]:
                best = (float(cost[k]), shape, xy[k])
        if best is None:
            return False
        _, shape, at = best
        z = config.support_z_m + config.clearance_m + shape.lowest_m
        self._prints[index], self._positions[index] = shape, np.array([at[0], at[1], z])
        self._on_table.append(index)
        self._storey[index] = 1
        return True

    def _candidates(self, index: int, shape: Footprint, count: int) -> Float[np.ndarray, "n 2"]:
        """Draw positions in the object's region: some anywhere, some right beside other objects."""
        rng, config = self._rng, self._config
        quarter = DIRECTIONS // 4
        # +x, +y, -x, -y
        reach = np.maximum(shape.extents[[0, quarter, 2 * quarter, 3 * quarter]] - config.margin_m, 0.0)
        (x0, x1), (y0, y1) = self._regions[index]
        low = np.array([x0 + reach[2], y0 + reach[3]])
        high = np.array([x1 - reach[0], y1 - reach[1]])
        if (low > high).any():
            return np.empty((0, 2))
        free = rng.uniform(low, high, (count, 2))
        if not self._on_table:
            return free
        k = rng.integers(DIRECTIONS, size=count)
        neighbours = rng.choice(self._on_table, size=count)
        centers = np.array([self._positions[int(n)][:2] for n in neighbours])
        spans = np.array([self._prints[int(n)].extents for n in neighbours])[np.arange(count), k]
        away = spans + shape.extents[(k + DIRECTIONS // 2) % DIRECTIONS] + rng.uniform(*config.gap_m, count)
        side = rng.normal(0.0, 0.02, count)[:, None] * directions()[(k + quarter) % DIRECTIONS]
        beside = centers + away[:, None] * directions()[k] + side
        return np.concatenate([free, beside[((beside >= low) & (beside <= high)).all(axis=1)]])


def drop_arrangement(names: Sequence[str], rng: np.random.Generator) -> list[ObjectPlacement]:
    """Return objects in random orientations, hanging above the table at staggered heights, in the order of `names`.

    No two overlap (bounding spheres). Raises UnknownNameError for an unknown model.
    """
    models = [load_object(name) for name in names]
    radii = np.array([bounding_radius(m) for m in models])
    positions = np.zeros((len(models), 3))
    placed: list[int] = []
    for i in rng.permutation(len(models)):
        positions[i] = _lowest_free(float(radii[i]), positions[placed], radii[placed], rng)
        placed.append(int(i))
    placements = []
    for name, model, position in zip(placement_names(names), models, positions):
        q = rng.normal(size=4)
        x, y, z, qw, qx, qy, qz = map(float, (*position, *(q / np.linalg.norm(q))))
        placements.append(ObjectPlacement(name, model.name, (x, y, z), (qw, qx, qy, qz)))
    return placements


def bounding_radius(model: ObjectModel) -> float:
    """Return the radius of a sphere about the model's origin that holds the bounding boxes of all its pieces."""
    corners = np.array(np.meshgrid(*[(0, 1)] * 3)).reshape(3, -1).T
    return max(
        float(np.linalg.norm(piece.bounds[corners, np.arange(3)], axis=1).max()) for piece in model.pieces
    )


def _lowest_free(
    radius: float, centers: np.ndarray, radii: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the lowest of some random positions at which a sphere touches none of the others."""
    half = np.maximum(np.array(DROP_SIZE) / 2 - radius, 0.0)
    xy = np.array(DROP_CENTER) + rng.uniform(-1, 1, (_DROP_CANDIDATES, 2)) * half
    z = np.full(len(xy), DROP_FROM_Z_M + radius)
    if len(centers):
        reach = radius + radii + DROP_GAP_M
        over2 = reach**2 - ((xy[:, None] - centers[None, :, :2]) ** 2).sum(axis=2)
        above = np.where(over2 > 0, centers[None, :, 2] + np.sqrt(np.maximum(over2, 0)), -np.inf)
        z = np.maximum(z, above.max(axis=1))
    k = int(np.argmin(z))
    return np.array([xy[k, 0], xy[k, 1], z[k]])
