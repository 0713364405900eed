"""Compute the learned picker's features of each graspable object: no picture, only what the planners compute."""

import numpy as np
from jaxtyping import Float32, UInt64

from torc.occlusion.volume import hidden_near_m3, hidden_volumes_m3
from torc.records import GraspStatus, PlanningContext
from torc.records.graph import DependencyEdge, EdgeKind
from torc.task_planning.belief.costs import Ways, ways_of
from torc.task_planning.belief.settings import BeliefConfig, HidingConfig, ParticleConfig
from torc.task_planning.belief.target_plans import free_target, search_target
from torc.task_planning.dg_select import decide_by_graph, distances_m
from torc.task_planning.graph_building import REACH_M, build_dependency_graph
from torc.task_planning.relations import find_relations

REASONING = BeliefConfig(ParticleConfig(told_size=False), HidingConfig(plain_share=0.5))
"""Settings for which the shipped picker was trained: the target's size is unknown."""

FEATURE_NAMES = (
    "target in sight",
    "is the target",
    "objects in sight",
    "picks so far",
    "probability by the graph",
    "chosen by the graph",
    "share of hidden volume",
    "hidden volume, litres",
    "share of the belief behind",
    "share of the belief revealed",
    "first of belief's order",
    "picks above belief's best",
    "hold",
    "valid grasps, log",
    "lies below others",
    "lies on the target",
    "in front of the target",
    "in the way of the target's grasps",
    "alone in the way of the target's grasps",
    "in the way of all grasps",
    "distance beyond the nearest, m",
    "top over the support, m",
    "share of the picture of objects",
)


def features_of(
    context: PlanningContext, rng: np.random.Generator
) -> tuple[tuple[int, ...], Float32[np.ndarray, "k f"]]:
    """Return the ids of the graspable objects, and a row of features for each; NaN where something is unknown."""
    ids = context.graspable_ids
    relations = find_relations(context.scene, REASONING.fallback.relations)
    ways = ways_of(context, relations)
    columns = {
        **_of_the_scene(context, ids),
        **_by_graph(context, ids),
        **_by_belief(context, ways, ids, rng),
        **_by_grasps(context, ways, ids),
        **_by_relations(relations, context.scene.target_number, ids),
    }
    rows = np.array([columns[name] for name in FEATURE_NAMES], dtype=np.float32).T
    return ids, rows.reshape(len(ids), len(FEATURE_NAMES))


def _of_the_scene(context: PlanningContext, ids: tuple[int, ...]) -> dict[str, list[float]]:
    scene, volume = context.scene, context.volume
    objects, away = {o.id: o for o in scene.objects}, distances_m(scene)
    all_px = max(sum(o.pixel_count for o in scene.objects), 1)
    if scene.target_id is None:
        hidden = hidden_volumes_m3(volume, scene.ids)
    else:
        hidden = hidden_near_m3(volume, scene.ids, objects[scene.target_id].points, REACH_M)
    own = dict(zip(scene.ids, hidden.tolist()))
    return {
        "target in sight": [float(scene.target_id is not None)] * len(ids),
        "is the target": [float(k == scene.target_id) for k in ids],
        "objects in sight": [float(len(scene.ids))] * len(ids),
        "picks so far": [float(len(context.history))] * len(ids),
        "share of hidden volume": [own[k] / max(sum(own.values()), 1e-12) for k in ids],
        "hidden volume, litres": [1e3 * own[k] for k in ids],
        "distance beyond the nearest, m": [away[k] - min(away.values()) for k in ids],
        "top over the support, m": [
            float(objects[k].points[:, 2].max() - volume.grid.origin[2]) for k in ids
        ],
        "share of the picture of objects": [objects[k].pixel_count / all_px for k in ids],
    }


def _by_graph(context: PlanningContext, ids: tuple[int, ...]) -> dict[str, list[float]]:
    graph = build_dependency_graph(context, REASONING.fallback.relations)
    decision = decide_by_graph(graph, context, REASONING.fallback.paths)
    p = decision.evidence.probabilities
    return {
        "probability by the graph": [p.get(k, 0.0) for k in ids],
        "chosen by the graph": [float(k == decision.object_id) for k in ids],
    }


def _by_belief(
    context: PlanningContext, ways: dict[int, Ways], ids: tuple[int, ...], rng: np.random.Generator
) -> dict[str, list[float]]:
    """Return BELIEF's estimates: the share behind each object, the share that it reveals, the picks if it is next."""
    target = context.scene.target_id
    behind: dict[int, float] = {}
    reveals: dict[int, float] = {}
    picks: dict[int, float] = {}
    first: int | None = None
    if target is None:
        search = search_target(context, ways, REASONING, rng)
        mass = search.belief.mass_behind()
        behind = {k: float(mass[k]) for k in ways}
        reveals = {k: search.reveals((k,)) for k in search.candidates}
        picks = {k: p for k, p in zip(search.candidates, search.plan.each.tolist()) if np.isfinite(p)}
        first = search.order[0] if search.order else None
    elif np.isfinite((access := free_target(context, ways, REASONING)).picks):
        first = access.order[0] if access.order else target
        picks = {first: access.picks} | ({target: access.now} if np.isfinite(access.now) else {})
    least, nan = min(picks.values(), default=0.0), float("nan")
    return {
        "share of the belief behind": [behind.get(k, nan) for k in ids],
        "share of the belief revealed": [reveals.get(k, nan) for k in ids],
        "first of belief's order": [float(k == first) for k in ids],
        "picks above belief's best": [picks.get(k, nan) - least for k in ids],
    }


def _by_grasps(
    context: PlanningContext, ways: dict[int, Ways], ids: tuple[int, ...]
) -> dict[str, list[float]]:
    report, target = context.report, context.scene.target_id
    valid = dict(zip(report.object_ids, report.valid_total.tolist()))
    blocked = report.status == GraspStatus.BLOCKED
    of_target = (
        report.blockers[blocked & (context.grasps.object_ids == target)] if target is not None else None
    )
    return {
        "hold": [ways[k].now for k in ids],
        "valid grasps, log": [float(np.log1p(valid.get(k, 0))) for k in ids],
        "lies below others": [float(ways[k].on_it.bit_count()) for k in ids],
        "in the way of the target's grasps": [_share(of_target, k) for k in ids],
        "alone in the way of the target's grasps": [_share(of_target, k, alone=True) for k in ids],
        "in the way of all grasps": [_share(report.blockers[blocked], k) for k in ids],
    }


def _share(blockers: UInt64[np.ndarray, "g"] | None, object_id: int, alone: bool = False) -> float:
    """Return the share of these grasps that the object blocks; NaN if there are no grasps."""
    if blockers is None or not len(blockers):
        return float("nan")
    bit = np.uint64(1) << np.uint64(object_id)
    return float(np.mean(blockers == bit if alone else (blockers & bit) != 0))


def _by_relations(
    relations: tuple[DependencyEdge, ...], target: int, ids: tuple[int, ...]
) -> dict[str, list[float]]:
    after = {
        kind: {r.target for r in relations if r.kind == kind and r.source == target} for kind in EdgeKind
    }
    return {
        "lies on the target": [float(k in after[EdgeKind.BELOW]) for k in ids],
        "in front of the target": [float(k in after[EdgeKind.BEHIND]) for k in ids],
    }
