"""What failed is not tried again in the same way: repeating a failed grasp on an unchanged object wastes picks.

An executed grasp that failed lowers the scores of grasps like it; one for which no motion was found makes them
invalid. Both are forgotten when the object is seen elsewhere, the latter also when the robot
has moved since.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from torc.geometry.transforms import Pose
from torc.pipeline.report import with_status
from torc.records import GraspReport, GraspSet, GraspStatus, SegmentedScene


@dataclass(frozen=True)
class FailedGrasp:
    """A grasp that failed.

    Attributes:
        object_id: the object.
        T_world_tcp: the grasp.
        seen_at: mean of the object's visible points at that time, world frame.
        executed: the robot tried it; else no motion was found.
    """

    object_id: int
    T_world_tcp: Pose
    seen_at: Float[np.ndarray, "3"]
    executed: bool


@dataclass(frozen=True)
class FailureConfig:
    """Attributes:
    distance_m, angle_rad: grasps closer than both are alike.
    score_factor: what an executed failure leaves of the score of grasps like it.
    moved_m: an object seen further than this from where it was has changed.
    """

    distance_m: float = 0.02
    angle_rad: float = 0.45
    score_factor: float = 0.4
    moved_m: float = 0.015


def still_valid(
    failed: tuple[FailedGrasp, ...], scene: SegmentedScene, config: FailureConfig
) -> tuple[FailedGrasp, ...]:
    """The failures that still tell something: their object is in sight and where it was."""
    places = {o.id: o.points.mean(axis=0) for o in scene.objects}
    return tuple(
        f
        for f in failed
        if f.object_id in places and np.linalg.norm(places[f.object_id] - f.seen_at) <= config.moved_m
    )


def lower_scores(grasps: GraspSet, failed: tuple[FailedGrasp, ...], config: FailureConfig) -> GraspSet:
    """The grasps with lower scores where one like it was executed and failed."""
    factor = np.ones(len(grasps))
    for f in failed:
        if f.executed:
            factor[_alike(grasps, f, config)] *= config.score_factor
    return replace(grasps, scores=grasps.scores * factor) if np.any(factor != 1) else grasps


def veto(
    report: GraspReport, grasps: GraspSet, failed: tuple[FailedGrasp, ...], config: FailureConfig
) -> GraspReport:
    """The report with NO_MOTION for valid grasps like one for which no motion was found."""
    status = report.status.copy()
    for f in failed:
        if not f.executed:
            status[_alike(grasps, f, config) & (status == GraspStatus.VALID)] = GraspStatus.NO_MOTION
    return with_status(report, grasps, status)


def _alike(grasps: GraspSet, failed: FailedGrasp, config: FailureConfig) -> Bool[np.ndarray, "n"]:
    """Whether each grasp is for the same object and about the same; a half turn about the approach makes none other."""
    T = grasps.Ts_world_tcp
    distance = np.linalg.norm(T[:, :3, 3] - failed.T_world_tcp[:3, 3], axis=1)
    relative = np.einsum("ij,njk->nik", failed.T_world_tcp[:3, :3].T, T[:, :3, :3])
    trace, z = np.trace(relative, axis1=1, axis2=2), relative[:, 2, 2]
    # After a half turn about z the trace is -r00 - r11 + r22.
    cosine = (np.maximum(trace, 2 * z - trace) - 1) / 2
    angle = np.arccos(np.clip(cosine, -1, 1))
    return (
        (grasps.object_ids == failed.object_id)
        & (distance <= config.distance_m)
        & (angle <= config.angle_rad)
    )
