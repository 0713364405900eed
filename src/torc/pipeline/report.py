"""Further reasons to hold a valid grasp back, beside those of the paper."""

from dataclasses import replace

import numpy as np
from jaxtyping import UInt8

from torc.records import GraspReport, GraspSet, GraspStatus


def with_status(report: GraspReport, grasps: GraspSet, status: UInt8[np.ndarray, "n"]) -> GraspReport:
    """The report with other statuses, its count of valid grasps per object brought in line."""
    valid = [np.count_nonzero(status[grasps.object_ids == k] == GraspStatus.VALID) for k in report.object_ids]
    return replace(report, status=status, valid_total=np.array(valid, dtype=np.int32))


def hold_back_unlikely(report: GraspReport, grasps: GraspSet, min_score: float) -> GraspReport:
    """The report with UNLIKELY for valid grasps that hold with a lower probability than min_score.

    Such a pick mostly pushes or topples what it is for. It is all objects together that count: an object may be left
    without a valid grasp because another one has a likely grasp. Where no grasp at all is likely the report stays as
    it is: a poor chance is better than none.
    """
    unlikely = (report.status == GraspStatus.VALID) & (grasps.scores < min_score)
    status = np.where(unlikely, np.uint8(GraspStatus.UNLIKELY), report.status)
    return with_status(report, grasps, status) if np.any(status == GraspStatus.VALID) else report
