"""What a small network sees of a look: arrays of fixed size, a row per object id.

They are made of the `PlanningContext` alone: nothing that a task planner does not see.
"""

from collections import Counter

import numpy as np
from jaxtyping import Float32, Int8

from torc.occlusion.hidden_space import hidden_volumes_m3
from torc.records import MAX_OBJECTS, TARGET_ID, GraspStatus, PlanningContext
from torc.task_planning.graph_building import build_dependency_graph

SHARES = ("best_score", "pixels", "hidden_volume", "blocked", "tried")
PER_OBJECT = ("visible", "graspable", "target", *SHARES, "position")
"""The keys with a row per object id; "position" has three columns."""


def observed(context: PlanningContext, max_picks: int) -> dict[str, np.ndarray]:
    """The features of a look, by the keys of the environment's observation space; docs/gym.md has their meaning."""
    scene, report, grasps, ids = context.scene, context.report, context.grasps, list(context.scene.ids)
    rows: dict[str, np.ndarray] = {
        "visible": _ones(ids),
        "graspable": action_mask(context),
        "target": _ones([TARGET_ID]),
        **{name: np.zeros(MAX_OBJECTS, np.float32) for name in SHARES},
        "position": np.zeros((MAX_OBJECTS, 3), np.float32),
        "edges": np.zeros((MAX_OBJECTS, MAX_OBJECTS), np.float32),
        "picks_left": np.array([context.picks_left / max_picks], np.float32),
    }
    for edge in build_dependency_graph(context).edges:
        rows["edges"][edge.source, edge.target] = edge.weight
    unseen = max(1, int(np.count_nonzero(~context.volume.seen)))
    grid = context.volume.grid
    rows["hidden_volume"][ids] = hidden_volumes_m3(context.volume, ids) / (unseen * grid.voxel_size_m**3)
    for o in scene.objects:
        of = grasps.object_ids == o.id
        valid = grasps.scores[of & (report.status == GraspStatus.VALID)]
        rows["best_score"][o.id] = valid.max(initial=0.0)
        rows["pixels"][o.id] = o.pixel_count / scene.label_image.size
        if len(o.points):  # their middle, -1 to 1 along each side of the workspace
            share = (o.points.mean(axis=0) - grid.origin) / (grid.upper - grid.origin)
            rows["position"][o.id] = np.clip(2.0 * share - 1.0, -1.0, 1.0)
        if of.any():
            rows["blocked"][o.id] = report.blocked_total[report.object_ids.index(o.id)] / np.count_nonzero(of)
    for object_id, times in Counter(outcome.object_id for outcome in context.history).items():
        if object_id >= 0:
            rows["tried"][object_id] = times / max_picks
    return rows


def action_mask(context: PlanningContext) -> Int8[np.ndarray, "64"]:
    """1 for the objects that can be picked now; all 0 if nothing can, and then every action is a lost pick."""
    return _ones(list(context.report.graspable_ids))


def stacked(observation: dict[str, np.ndarray]) -> Float32[np.ndarray, "64 f"]:
    """The per-object features of an observation side by side, for a network that looks at one object at a time.

    The columns are those of PER_OBJECT and, last, the weight of the edge that the target has to the object.
    """
    columns = [observation[key].reshape(MAX_OBJECTS, -1) for key in PER_OBJECT]
    return np.hstack([*columns, observation["edges"][TARGET_ID][:, None]]).astype(np.float32)


def _ones(ids: list[int]) -> Int8[np.ndarray, "64"]:
    flags = np.zeros(MAX_OBJECTS, np.int8)
    flags[ids] = 1
    return flags
