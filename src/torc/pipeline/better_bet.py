"""Hold a doubtful grasp back while clearing neighbours first is the better bet.

A failed try costs a pick; one that fails with the target may lose it, and with it all picks that are left. So the
expected number of picks to get an object out by a grasp that succeeds with probability p is

    cost(p) = tries + lost * picks_left,  tries = 1 / (p + q (1 - p)),  lost = q (1 - p) * tries

where q is the share of failed tries that lose the object: 0 for all but the target. An object waits if only graspable
neighbours block a better grasp of it, and clearing them, at 1 / p(neighbour) each, plus cost(better) is less than the
cost now.

Objects never wait for each other in a circle: an object other than the target waits only for objects that are likelier
to come out, and nothing waits for the target.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from torc.errors import InputError
from torc.pipeline.failures import with_status
from torc.records import GraspReport, GraspSet, GraspStatus
from torc.task_planning.belief.costs import expected_picks


def hold_back_unlikely(report: GraspReport, grasps: GraspSet, min_score: float) -> GraspReport:
    """Mark valid grasps that hold with a lower probability than min_score as UNLIKELY, and return the new report.

    Such a pick mostly pushes or topples its object. All objects count together: an object may be left without a valid
    grasp because another one has a likely grasp. If no grasp at all is likely the report is unchanged: a poor chance is
    better than none.
    """
    unlikely = (report.status == GraspStatus.VALID) & (grasps.scores < min_score)
    status = np.where(unlikely, np.uint8(GraspStatus.UNLIKELY), report.status)
    return with_status(report, grasps, status) if np.any(status == GraspStatus.VALID) else report


@dataclass(frozen=True)
class BetConfig:
    """When a doubtful grasp waits."""

    lost_share: float = 0.15
    """Share of the failed tries with the target that lose it: 64 of 417 in results/torc40-simulated-vlm."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.lost_share <= 1.0:
            raise InputError(f"BetConfig.lost_share is {self.lost_share}; it is a share, from 0 to 1.")


def hold_back_worse_bets(
    report: GraspReport, grasps: GraspSet, target_id: int | None, picks_left: int, config: BetConfig
) -> GraspReport:
    """Mark the valid grasps of every object that had better wait as UNLIKELY; `picks_left` includes this attempt."""
    best: dict[int, float] = {}
    """The score of the best valid grasp of each object that has one."""
    for grasp in np.flatnonzero(report.status == GraspStatus.VALID).tolist():
        k = int(grasps.object_ids[grasp])
        best[k] = max(best.get(k, 0.0), float(grasps.scores[grasp]))
    picks = expected_picks(np.array([*best.values()]), 0.0, np.array(picks_left))
    clearing = dict(zip(best, picks.tolist()))
    waits = []
    for object_id, score in best.items():
        lost_share = config.lost_share if object_id == target_id else 0.0
        better = list(_ways_to_better_grasps(object_id, target_id, clearing, report, grasps))
        left = np.maximum(picks_left - np.array([0, *(n for n, _, _ in better)]), 0)
        scores = np.array([score, *(p for _, p, _ in better)])
        now, *later = expected_picks(scores, lost_share, left).tolist()
        if any(cost + then < now for (_, _, cost), then in zip(better, later)):
            waits.append(object_id)
    held_back = (report.status == GraspStatus.VALID) & np.isin(grasps.object_ids, waits)
    return with_status(report, grasps, np.where(held_back, np.uint8(GraspStatus.UNLIKELY), report.status))


def _ways_to_better_grasps(
    object_id: int,
    target_id: int | None,
    clearing: Mapping[int, float],
    report: GraspReport,
    grasps: GraspSet,
) -> Iterator[tuple[int, float, float]]:
    """For each blocked grasp that other graspable objects alone block: how many they are, the grasp's probability, and
    the picks that clearing them takes.
    """
    for grasp in np.flatnonzero((grasps.object_ids == object_id) & (report.status == GraspStatus.BLOCKED)):
        bits = int(report.blockers[grasp])
        in_the_way = [k for k in clearing if k != object_id and bits >> k & 1]
        if in_the_way and target_id not in in_the_way and sum(1 << k for k in in_the_way) == bits:
            yield len(in_the_way), float(grasps.scores[grasp]), sum(clearing[k] for k in in_the_way)
