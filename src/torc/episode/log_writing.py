"""Events to lines of the log."""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from torc.episode.events import (
    Decided,
    Ended,
    EpisodeResult,
    Event,
    Executed,
    Halted,
    Looked,
    Planned,
    Started,
)
from torc.episode.identity import mask_faults, true_ids
from torc.episode.log_lines import LOG_LINE
from torc.io.record_files import to_plain
from torc.pipeline.look import Look
from torc.records import GraspStatus, PickPlan, PlanFailure


def log_line(event: Event) -> dict[str, Any]:
    """An event as JSON-compatible data. What is written can be read: it goes through the models that read it."""
    match event:
        case Started():
            facts = to_plain(event)
            if not event.guard:
                del facts["guard"]
        case Ended():
            facts = result_facts(event.result)
        case Looked():
            facts = {**_look_facts(event.look), "seconds": _round(event.look.seconds)}
        case Decided():
            facts = {**to_plain(event.decision), "seconds": round(event.seconds, 4)}
            if not event.decision.is_target:
                del facts["is_target"]
        case Planned():
            facts = {**_plan_facts(event.look, event.plan), "seconds": round(event.seconds, 4)}
            if event.ways:
                facts["ways"] = dict(event.ways)
        case Executed():
            facts = {**to_plain(event.outcome), "seconds": round(event.seconds, 3)}
            for name in ("true_id", "target_p"):
                if facts[name] is None:
                    del facts[name]
        case Halted():
            facts = {"reason": event.reason}
    pick = {} if isinstance(event, Started | Ended) else {"pick": event.pick}
    line = LOG_LINE.validate_python({"event": type(event).__name__.lower(), **pick, **facts})
    plain: dict[str, Any] = line.model_dump(mode="json", exclude_unset=True)
    return plain


def result_facts(result: EpisodeResult) -> dict[str, Any]:
    """The outcome of an episode as it stands in result.json."""
    executed = [o for o in result.outcomes if o.result.grasp_tried]
    return {
        "retrieved": result.retrieved,
        "held_target": result.held_target,
        "end": result.end.value,
        "picks": result.picks,
        "drops": len(result.dropped),
        "dropped": list(result.dropped),
        "outcomes": [o.result.value for o in result.outcomes],
        "grasps_executed": len(executed),
        "grasps_held": sum(o.held_after_lift for o in executed),
        "grasps_delivered": sum(o.delivered for o in executed),
        "seconds": _round(result.seconds),
    }


def without_seconds(value: Any) -> Any:
    """A log line less its wall times: what must be identical when a trial is run again."""
    if isinstance(value, Mapping):
        return {k: without_seconds(v) for k, v in value.items() if k != "seconds"}
    if isinstance(value, list | tuple):
        return [without_seconds(v) for v in value]
    return value


def digest(*arrays: np.ndarray) -> str:
    """Short fingerprint of arrays, bit for bit: tells whether two runs saw and did the same."""
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(np.ascontiguousarray(array).tobytes())
    return sha.hexdigest()[:16]


def _look_facts(look: Look) -> dict[str, Any]:
    context = look.context
    scene, grasps, report, volume = context.scene, context.grasps, context.report, context.volume
    depth_m, truth = scene.observation.depth_m, true_ids(look)
    faults = mask_faults(look)
    return {
        "target_visible": scene.target_id is not None,
        "objects": [{"id": o.id, "pixels": o.pixel_count} for o in scene.objects],
        "unknown_voxels": int(np.count_nonzero(~volume.seen)),
        "graspable": list(report.graspable_ids),
        "grasps": {s.name.lower(): int(np.count_nonzero(report.status == s)) for s in GraspStatus},
        "valid_grasps": dict(zip(map(str, report.object_ids), report.valid_total.tolist())),
        "blocking": [
            {"object": a, "by": b, "grasps": int(report.blocking[i, j])}
            for i, a in enumerate(report.object_ids)
            for j, b in enumerate(report.object_ids)
            if report.blocking[i, j]
        ],
        **({"true_ids": {str(k): true for k, true in truth.items()}} if truth else {}),
        **({} if faults is None else {"mask_faults": to_plain(faults)}),
        "digest": digest(depth_m, scene.label_image, grasps.Ts_world_tcp, grasps.scores, report.qpos),
    }


def _plan_facts(look: Look, plan: PickPlan | PlanFailure) -> dict[str, Any]:
    if isinstance(plan, PlanFailure):
        return {"failure": to_plain(plan)}
    grasps, g = look.context.grasps, plan.grasp_index
    motions = {name: getattr(plan, name) for name in ("free", "approach", "lift", "transfer", "home")}
    return {
        "object_id": plan.object_id,
        "score": float(grasps.scores[g]),
        "generator": grasps.generator_names[int(grasps.generators[g])],
        "T_world_tcp": plan.T_world_tcp.tolist(),
        "width_m": float(plan.width_m),
        "grasps_tried": plan.grasps_tried,
        "durations_s": {name: motion.duration_s for name, motion in motions.items()},
        "digest": digest(*(motion.qpos for motion in motions.values())),
    }


def _round(seconds: Mapping[str, float]) -> dict[str, float]:
    return {name: round(value, 4) for name, value in seconds.items()}
