"""Remember failures: repeating a failed grasp on an unchanged object wastes picks.

An executed grasp that failed lowers the scores of similar grasps. One for which no motion was found invalidates them,
and if that happens again, all of the object's. Both are forgotten when the object is seen elsewhere, the latter also
when the robot has moved since.

The object itself stays under suspicion for the rest of the episode: grasp models see its shape, not that it is heavy,
slippery or wedged in, and every failure suggests that it is harder to hold than it looks.
"""

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float, UInt8

from torc.errors import InputError
from torc.geometry.transforms import Pose
from torc.records import GraspReport, GraspSet, GraspStatus, PickOutcome, SegmentedScene


@dataclass(frozen=True)
class FailedGrasp:
    """A grasp that was executed and failed, or had no motion; world frame.

    Attributes:
        seen_at: mean of the object's visible points then.
        executed: False if no motion was found.
        touched: points that a finger touched where nothing was seen (`torc.pipeline.touch`).
        again: the object had no motion for the second time; stands for all its grasps.
    """

    object_id: int
    T_world_tcp: Pose
    seen_at: Float[np.ndarray, "3"]
    executed: bool
    touched: Float[np.ndarray, "n 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    again: bool = False


@dataclass(frozen=True)
class FailureConfig:
    """How failures count.

    Attributes:
        distance_m, angle_rad: grasps closer than both are alike.
        score_factor: factor on the scores of grasps like an executed one that failed.
        moved_m: an object seen further than this from where it was has changed.
        log_odds: what every failed try with an object takes from the log-odds of all its grasps; 0 for nothing.
            Measured by benchmarks/failure_memory.py.
    """

    distance_m: float = 0.02
    angle_rad: float = 0.45
    score_factor: float = 0.4
    moved_m: float = 0.015
    log_odds: float = 0.9

    def __post_init__(self) -> None:
        if not 0.0 <= self.log_odds < np.inf:
            raise InputError(f"A failure takes {self.log_odds} from the log-odds; it takes 0 or more.")


def with_status(report: GraspReport, grasps: GraspSet, status: UInt8[np.ndarray, "n"]) -> GraspReport:
    """Return the report with other statuses and its count of valid grasps per object updated."""
    valid = [np.count_nonzero(status[grasps.object_ids == k] == GraspStatus.VALID) for k in report.object_ids]
    return replace(report, status=status, valid_total=np.array(valid, dtype=np.int32))


def still_valid(
    failed: tuple[FailedGrasp, ...], scene: SegmentedScene, config: FailureConfig
) -> tuple[FailedGrasp, ...]:
    """Return the failures that still count: their object is in sight and where it was."""
    places = {o.id: o.points.mean(axis=0) for o in scene.objects}
    return tuple(
        f
        for f in failed
        if f.object_id in places and np.linalg.norm(places[f.object_id] - f.seen_at) <= config.moved_m
    )


def lower_scores(
    grasps: GraspSet, failed: tuple[FailedGrasp, ...], history: tuple[PickOutcome, ...], config: FailureConfig
) -> GraspSet:
    """Lower the scores of grasps if a similar one, or any other of their object, was executed and failed.

    `failed` are the failures that still count, `history` all picks so far.
    """
    factor, tries = np.ones(len(grasps)), failed_tries(history)
    for f in failed:
        if f.executed and not len(f.touched):
            factor[_alike(grasps, f, config)] *= config.score_factor
    if not tries and np.all(factor == 1):
        return grasps
    scores = grasps.scores * factor
    odds_against = np.exp(config.log_odds * np.array([tries[k] for k in grasps.object_ids.tolist()]))
    return replace(grasps, scores=scores / (scores + (1 - scores) * odds_against))


def failed_tries(history: tuple[PickOutcome, ...]) -> Counter[int]:
    """Return how often the robot tried to grasp each object and did not deliver it, by object id."""
    return Counter(o.object_id for o in history if o.result.grasp_tried and not o.delivered)


def veto(
    report: GraspReport, grasps: GraspSet, failed: tuple[FailedGrasp, ...], config: FailureConfig
) -> GraspReport:
    """Mark valid grasps like one for which no motion was found as NO_MOTION, and return the new report."""
    status = report.status.copy()
    for f in failed:
        if not f.executed:
            meant = grasps.object_ids == f.object_id if f.again else _alike(grasps, f, config)
            status[meant & (status == GraspStatus.VALID)] = GraspStatus.NO_MOTION
    return with_status(report, grasps, status)


def _alike(grasps: GraspSet, failed: FailedGrasp, config: FailureConfig) -> Bool[np.ndarray, "n"]:
    """Return whether each grasp is similar to a failed one of its object, ignoring half turns about the approach."""
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
