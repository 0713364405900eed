"""Clutter at rest: from models to a settled scene with every object within reach of the robot."""

from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from torc.errors import InputError
from torc.generation.arrangements import StructuredConfig, drop_arrangement, structured_arrangement
from torc.generation.config import MANY, Reason, RejectedError
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem
from torc.problems.schema import Category
from torc.sim.contacts import deepest_overlap
from torc.sim.settling import (
    COARSE,
    DumpConfig,
    SettleConfig,
    StillnessConfig,
    StillnessReport,
    dump,
    settle_problem,
    watch_stillness,
    with_poses_of,
)
from torc.sim.simulated_world import World, build_world
from torc.workspace.description import Room, Workspace

MAX_OVERLAP_M = 0.0015
"""Objects at rest overlap by less than half of this; deeper ones are wedged, and jump apart when one is picked up."""


@dataclass(frozen=True)
class ClutterConfig:
    """How clutter is made.

    Attributes:
        center_xy: where it is, world, metres.
        region_m: largest lengths along x and y of a structured arrangement's region ...
        fill: ... which shrinks until the objects' footprints take up this share of it; tried from the tightest on.
        arrangement: further settings of structured arrangements.
        walls_m: largest lengths along x and y of the walls that a pile is dumped between ...
        heap: ... which shrink until the objects' mean shadows would cover this share of the floor.
        reach_xy: ((x0, x1), (y0, y1)) of the origins of objects that the robot can grasp when they stand alone.
        edge_m: distance that every part of an object keeps from the table's edge.
        drop_s: simulated time between two objects of a pile.
        places: how many places are tried for each of them; see DumpConfig.
        rough: when a pile counts as settled for now.
        calm: when a settled scene is calm enough to look for a target in it; the chosen one is watched for longer.
        calm_rounds: how often a scene that is not calm may lose the object that moves most, or continue ...
        idle_rounds: ... and how often it may continue with no object to spare: objects that still creep rarely stop.
        spare: share of objects dumped beyond those wanted, at least two: some roll away, creep or cannot be picked up.
    """

    center_xy: tuple[float, float] = (0.65, -0.12)
    region_m: tuple[float, float] = (0.36, 0.60)
    fill: tuple[float, ...] = (0.62, 0.52, 0.42)
    arrangement: StructuredConfig = field(
        default_factory=lambda: StructuredConfig(restarts=4, lying_width_m=0.08)
    )
    walls_m: tuple[float, float] = (0.42, 0.46)
    heap: float = 0.85
    reach_xy: tuple[tuple[float, float], tuple[float, float]] = ((0.45, 0.90), (-0.50, 0.20))
    edge_m: float = 0.005
    drop_s: float = 0.2
    places: int = 1
    rough: SettleConfig = field(
        default_factory=lambda: SettleConfig(speed_m_s=0.02, quiet_s=0.2, limit_s=2.0)
    )
    calm: StillnessConfig = field(
        default_factory=lambda: StillnessConfig(
            distance_m=0.00035, angle_rad=float(np.deg2rad(0.35)), seconds=2.5, early_s=1.25
        )
    )
    calm_rounds: int = 12
    idle_rounds: int = 2
    spare: float = 0.15


LARGE_PILE = ClutterConfig(
    center_xy=(0.66, -0.13),
    walls_m=(0.44, 0.60),
    drop_s=0.3,
    places=8,
    calm_rounds=40,
    idle_rounds=4,
    spare=0.4,
)
"""For more objects than MANY. Made like small piles, they would fall half a metre, into each other, and in a heap that
high too much creeps: here they are poured in layers, as wide as the arm reaches, with more objects to spare.
"""
_FROM_WALL_M = 0.012
"""Distance of standing objects from the walls of a room."""


def clutter_config(category: Category, count: int, room: Room | None = None) -> ClutterConfig:
    """Return how a scene of this many objects is made. Raises InputError for a pile in a room with a roof."""
    config = LARGE_PILE if category == "unstructured" and count > MANY else ClutterConfig()
    if room is None:
        return config
    if category == "unstructured" and not room.open_above:
        raise InputError("Nothing can be dumped under a roof: --structured.")
    (x, y), (lx, ly) = room.center, room.size
    return replace(
        config,
        center_xy=room.center,
        region_m=(lx - 2 * _FROM_WALL_M, ly - 2 * _FROM_WALL_M),
        fill=(*config.fill, 0.34, 0.28, 0.22),
        walls_m=room.size,
        arrangement=replace(config.arrangement, margin_m=0.0),
        reach_xy=((x - lx / 2, x + lx / 2), (y - ly / 2, y + ly / 2)),
    )


@dataclass(frozen=True)
class ObjectRange:
    """How many objects a scene may have in the end: at least 1, fewest first."""

    fewest: int
    most: int


def make_clutter(
    models: list[str],
    category: Category,
    wanted: ObjectRange,
    workspace: Workspace,
    rng: np.random.Generator,
    config: ClutterConfig,
) -> Problem:
    """Bring objects to rest on the table. The first object stands in as the target.

    Objects that end up out of reach or over the edge, or that keep creeping, are removed as long as enough are left;
    `models` may be more than wanted in the end. Raises RejectedError or PhysicsError if there is no such scene, and
    UnknownNameError for an unknown model.
    """
    if category == "unstructured":
        scene = _scene(category, drop_arrangement(models, rng))
        # The mean area of a box's shadow over all orientations is a quarter of its surface (Cauchy).
        shadows_m2 = sum(0.5 * (a * b + b * c + c * a) for a, b, c in (load_object(m).size_m for m in models))
        walls = _shrunk(config.walls_m, shadows_m2 / config.heap)
        dumping = DumpConfig(config.center_xy, walls, interval_s=config.drop_s, places=config.places)
        scene = dump(scene, workspace, rng, dumping, config.rough, COARSE)[0]
    else:
        objects = _side_by_side(models, workspace, rng, config)
        scene = settle_problem(_scene(category, objects), workspace)[0]
    return _calmed(scene, wanted, workspace, config)


def again_at_rest(
    scene: Problem, gone: tuple[str, ...], wanted: ObjectRange, workspace: Workspace, config: ClutterConfig
) -> Problem:
    """Settle a scene after some objects were removed, or after it moved (none removed). Raises like `make_clutter`."""
    return _calmed(_settled_without(scene, gone, wanted, workspace, config), wanted, workspace, config)


def worst_mover(world: World, report: StillnessReport, limits: StillnessConfig) -> str:
    """Return the object of a watched world that moved furthest beyond the limits."""
    excess = np.maximum(report.distances_m / limits.distance_m, report.angles_rad / limits.angle_rad)
    return world.problem.ordered()[int(np.argmax(excess))].name


def astray(problem: Problem, workspace: Workspace, config: ClutterConfig) -> tuple[str, ...]:
    """Return names of the objects that are out of the robot's reach, or over the edge of the table."""
    return tuple(o.name for o in problem.objects if _is_astray(o, workspace, config))


def _side_by_side(
    models: list[str], workspace: Workspace, rng: np.random.Generator, config: ClutterConfig
) -> list[ObjectPlacement]:
    """Return the tightest structured arrangement that is found."""
    footprints_m2 = sum(m.size_m[0] * m.size_m[1] for m in map(load_object, models))
    for fill in config.fill:
        lengths = _shrunk(config.region_m, footprints_m2 / fill)
        (x, y), (lx, ly) = config.center_xy, lengths
        region = ((x - lx / 2, x + lx / 2), (y - ly / 2, y + ly / 2))
        arrangement = replace(config.arrangement, region=region, support_z_m=workspace.support_z_m)
        with suppress(InputError):
            return structured_arrangement(models, rng, arrangement)
    raise RejectedError(Reason.DOES_NOT_FIT)


def _settled_without(
    scene: Problem, gone: tuple[str, ...], wanted: ObjectRange, workspace: Workspace, config: ClutterConfig
) -> Problem:
    if len(scene.objects) - len(gone) < wanted.fewest:
        raise RejectedError(Reason.TOO_FEW_LEFT)
    return settle_problem(without(scene, gone), workspace, config.rough, COARSE)[0]


def _tidied(scene: Problem, wanted: ObjectRange, workspace: Workspace, config: ClutterConfig) -> Problem:
    while gone := astray(scene, workspace, config):
        scene = _settled_without(scene, gone, wanted, workspace, config)
    return scene


def _calmed(scene: Problem, wanted: ObjectRange, workspace: Workspace, config: ClutterConfig) -> Problem:
    """Tidy a scene and let it continue until it hardly moves, each time watched from rest, as a problem file starts.

    The object that moves most is removed as long as there are objects to spare: a thing that slowly slips or rolls in a
    pile does so for minutes, and simulated contacts always give way a little. Objects on top of it then fall, so the
    scene comes to rest again before anything else is blamed.
    """
    idle = 0
    for _ in range(config.calm_rounds):
        scene = _tidied(scene, wanted, workspace, config)
        world = build_world(scene, None, workspace, COARSE)
        to_spare, overlap = len(scene.objects) > wanted.fewest, deepest_overlap(world)
        gone = tuple[str, ...]()
        if overlap.depth_m > MAX_OVERLAP_M:
            if not to_spare:
                raise RejectedError(Reason.WEDGED)
            # The highest one carries the least.
            highest = max(overlap.object_ids, key=lambda k: float(world.positions[k, 2]))
            gone = (world.problem.ordered()[highest].name,)
        else:
            report = watch_stillness(world, config.calm)
            if report.still and len(scene.objects) <= wanted.most:
                return scene
            if report.still:  # the object furthest from the middle matters least
                away = [np.hypot(*np.subtract(o.position[:2], config.center_xy)) for o in scene.objects]
                gone = (scene.objects[int(np.argmax(away))].name,)
            elif to_spare:
                gone = (worst_mover(world, report, config.calm),)
            elif idle == config.idle_rounds:
                raise RejectedError(Reason.NOT_AT_REST)
            else:
                idle += 1
        scene = _settled_without(with_poses_of(world), gone, wanted, workspace, config)
    _tidied(scene, wanted, workspace, config)
    raise RejectedError(Reason.NOT_AT_REST)


def without(scene: Problem, names: tuple[str, ...]) -> Problem:
    """Return the scene without some objects; if the target is among them, the first one left stands in for it."""
    rest = tuple(o for o in scene.objects if o.name not in names)
    return replace(scene, objects=rest, target=scene.target if scene.target not in names else rest[0].name)


def _is_astray(placement: ObjectPlacement, workspace: Workspace, config: ClutterConfig) -> bool:
    x, y, z = placement.position
    (x0, x1), (y0, y1) = config.reach_xy
    if not (x0 <= x <= x1 and y0 <= y <= y1 and z > workspace.support_z_m):
        return True
    R, model = placement.T_world_object[:3, :3], load_object(placement.model)
    ways = np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]])
    reach = model.support(ways @ R) + ways[:, :2] @ [x, y]
    (cx, cy, _), (lx, ly, _) = workspace.table.center, workspace.table.size
    edges = np.array([cx + lx / 2, cy + ly / 2, lx / 2 - cx, ly / 2 - cy])
    return bool((reach > edges - config.edge_m).any())


def _shrunk(lengths: tuple[float, float], area_m2: float) -> tuple[float, float]:
    """Return the rectangle scaled down to an area, if it is larger."""
    scale = min(1.0, float(np.sqrt(area_m2 / (lengths[0] * lengths[1]))))
    return scale * lengths[0], scale * lengths[1]


def _scene(category: Category, objects: list[ObjectPlacement]) -> Problem:
    return Problem("scene", category, "", objects[0].name, tuple(objects))
