"""What a task planner saw before one pick, small enough to keep: for the page of `torc human` and `torc view`."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float, Float32, Int8, Int16, UInt8, UInt16, UInt32, UInt64
from pydantic import Field, FiniteFloat, NonNegativeInt, TypeAdapter, ValidationError

from torc.errors import InputError
from torc.geometry.transforms import Pose, project
from torc.io.record_files import load_checked, to_plain
from torc.occlusion.volume import hidden_volumes_m3
from torc.records import BACKGROUND, MAX_OBJECTS, GraspStatus, PlanningContext, VoxelGrid
from torc.specs.conditions import DEFAULT_MIN_SCORE
from torc.task_planning.graph_building import build_dependency_graph

MAX_OBJECT_POINTS, MAX_BACKGROUND_POINTS = 24_000, 12_000
GRASPS_PER_OBJECT = 6
POINT_UNIT_M = 0.001
MAX_UNPACKED_BYTES = 64 * 2**20
MAX_GRID = 2048
LIKELY = DEFAULT_MIN_SCORE
"""From this probability of success on, a grasp is called likely."""
_Id = Annotated[int, Field(ge=0, lt=MAX_OBJECTS)]
_IdText = Annotated[str, Field(pattern=r"^\d{1,2}$")]


@dataclass(frozen=True)
class ObjectView:
    """What is known of one visible object.

    Attributes:
        statuses: how many of its grasps have each GraspStatus (name in lower case), zeros left out.
        blockers: how many of its grasps each other object blocks (id as text), zeros left out.
        best_score: the probability of its best valid grasp.
        hidden_volume_m3: the unseen volume that it hides.
        likely_if_free: how many of its blocked grasps are LIKELY to succeed once unblocked; None in older files.
    """

    id: _Id
    pixels: NonNegativeInt
    statuses: Mapping[str, NonNegativeInt]
    blockers: Mapping[_IdText, NonNegativeInt]
    best_score: FiniteFloat | None
    hidden_volume_m3: FiniteFloat
    likely_if_free: NonNegativeInt | None = None


@dataclass(frozen=True)
class CloudView:
    """Part of the surface points, evenly thinned; world frame, in steps of POINT_UNIT_M.

    `rgb` are their colors, `ids` their object ids, or BACKGROUND.
    """

    points: Int16[np.ndarray, "n 3"]
    rgb: UInt8[np.ndarray, "n 3"]
    ids: Int8[np.ndarray, "n"]


@dataclass(frozen=True)
class UnseenView:
    """The index of each voxel that no snapshot has seen, and its row in `hiders`.

    `hiders` are the distinct masks of `OcclusionVolume.hidden_by`.
    """

    grid: VoxelGrid
    index: UInt16[np.ndarray, "m 3"]
    hider: UInt32[np.ndarray, "m"]
    hiders: UInt64[np.ndarray, "s"]


@dataclass(frozen=True)
class GraspView:
    """The best grasps of each object, valid ones first, as in `GraspSet`, with their GraspStatus."""

    Ts_world_tcp: Float32[np.ndarray, "g 4 4"]
    widths_m: Float32[np.ndarray, "g"]
    scores: Float32[np.ndarray, "g"]
    object_ids: Int8[np.ndarray, "g"]
    status: UInt8[np.ndarray, "g"]


@dataclass(frozen=True)
class PickView:
    """One pick as the task planner sees it: objects by rising id; `graph` is `DependencyGraph.to_dict` by geometry."""

    label_image: Int8[np.ndarray, "h w"]
    K: Float[np.ndarray, "3 3"]
    T_world_camera: Pose
    objects: tuple[ObjectView, ...]
    graph: Mapping[str, Any]
    cloud: CloudView
    unseen: UnseenView
    grasps: GraspView


_OBJECTS = TypeAdapter(tuple[ObjectView, ...])
_SIZE = Annotated[int, Field(gt=0, le=MAX_GRID)]
_GRID = TypeAdapter(tuple[Annotated[float, Field(gt=0.0, lt=1.0)], _SIZE, _SIZE, _SIZE])


def view_of(context: PlanningContext) -> PickView:
    """Return the view of a context. Equal contexts give equal views; nothing is drawn at random."""
    observation = context.scene.observation
    return PickView(
        label_image=context.scene.label_image.astype(np.int8),
        K=observation.K,
        T_world_camera=observation.T_world_camera,
        objects=_objects(context),
        graph=MappingProxyType(build_dependency_graph(context).to_dict()),
        cloud=_cloud(context),
        unseen=_unseen(context),
        grasps=_grasps(context),
    )


def _objects(context: PlanningContext) -> tuple[ObjectView, ...]:
    grasps, report, ids = context.grasps, context.report, context.scene.ids
    hidden = hidden_volumes_m3(context.volume, ids).tolist()
    views = []
    for o, hidden_m3 in zip(context.scene.objects, hidden):
        of = grasps.object_ids == o.id
        status = report.status[of]
        valid = grasps.scores[of][status == GraspStatus.VALID]
        counts = {s.name.lower(): n for s in GraspStatus if (n := int(np.count_nonzero(status == s)))}
        row = report.blocking[report.object_ids.index(o.id)] if o.id in report.object_ids else ()
        blockers = {str(k): int(n) for k, n in zip(report.object_ids, row) if n > 0}
        best = float(valid.max()) if valid.size else None
        likely = np.count_nonzero(grasps.scores[of][status == GraspStatus.BLOCKED] >= LIKELY)
        views.append(ObjectView(o.id, o.pixel_count, counts, blockers, best, hidden_m3, int(likely)))
    return tuple(views)


def _cloud(context: PlanningContext) -> CloudView:
    scene, grid = context.scene, context.volume.grid
    objects = np.concatenate([np.zeros((0, 3), np.float32), *(o.points for o in scene.objects)])
    object_ids = np.repeat(np.array(scene.ids, int), [len(o.points) for o in scene.objects])
    objects, object_ids = _thinned(objects, MAX_OBJECT_POINTS), _thinned(object_ids, MAX_OBJECT_POINTS)
    around = np.all(
        (scene.background_points >= grid.origin - 0.1) & (scene.background_points <= grid.upper), 1
    )
    background = _thinned(scene.background_points[around], MAX_BACKGROUND_POINTS)
    points = np.concatenate([objects, background])
    ids = np.concatenate([object_ids, np.full(len(background), BACKGROUND)]).astype(np.int8)
    o, (height, width) = scene.observation, scene.label_image.shape
    cols, rows, _ = project(points, o.K, o.T_world_camera)
    row, col = np.clip(np.rint(rows), 0, height - 1), np.clip(np.rint(cols), 0, width - 1)
    rgb = o.rgb[row.astype(int), col.astype(int)]  # the pixel in which the camera saw each point
    return CloudView(np.rint(points / POINT_UNIT_M).astype(np.int16), rgb, ids)


def _thinned(rows: np.ndarray, most: int) -> np.ndarray:
    """Return every n-th row, so that at most `most` are left."""
    return rows[:: max(1, -(-len(rows) // most))]


def _unseen(context: PlanningContext) -> UnseenView:
    volume = context.volume
    index = np.argwhere(~volume.seen)
    hiders, hider = np.unique(volume.hidden_by[tuple(index.T)], return_inverse=True)
    return UnseenView(volume.grid, index.astype(np.uint16), hider.ravel().astype(np.uint32), hiders)


def _grasps(context: PlanningContext) -> GraspView:
    grasps, status = context.grasps, context.report.status
    kept: list[int] = []
    for k in context.scene.ids:
        ranked = grasps.of(k)
        valid_first = np.argsort(status[ranked] != GraspStatus.VALID, kind="stable")
        kept += ranked[valid_first][:GRASPS_PER_OBJECT].tolist()
    return GraspView(
        grasps.Ts_world_tcp[kept].astype(np.float32),
        grasps.widths_m[kept].astype(np.float32),
        grasps.scores[kept].astype(np.float32),
        grasps.object_ids[kept].astype(np.int8),
        status[kept].astype(np.uint8),
    )


def load_view(path: Path) -> PickView:
    """Read the view that `save_record` wrote.

    Raises InputError if it is missing, damaged, too large, or its arrays do not fit each other: it may come from a
    stranger.
    """
    view = load_checked(path, PickView, MAX_UNPACKED_BYTES, "view of a pick")
    grid, hider, hiders = view.unseen.grid, view.unseen.hider, view.unseen.hiders
    try:
        _OBJECTS.validate_json(json.dumps(to_plain(view.objects)), strict=True)
        _GRID.validate_python((grid.voxel_size_m, *grid.shape), strict=True)
    except ValidationError as error:
        raise InputError(f"'{path}' holds no view of a pick: {error.errors()[0]['msg']}") from None
    within = bool((view.unseen.index < np.array(grid.shape)).all()) and bool((hider < len(hiders)).all())
    if not within or len({o.id for o in view.objects}) < len(view.objects):
        raise InputError(f"'{path}' holds no view of a pick: its arrays are not as torc writes them.")
    return view
