"""Explain in words why nothing can be grasped, by the counts of the checks that failed."""

from collections.abc import Mapping

import numpy as np

from torc.records import GraspReport, GraspStatus

_WORDS: Mapping[GraspStatus, str] = {
    GraspStatus.UNREACHABLE: "out of reach",
    GraspStatus.BLOCKED: "blocked by other objects",
    GraspStatus.HITS_STATIC: "stopped by the table, another fixed part, or the robot itself",
    GraspStatus.SEVERAL_OBJECTS: "around no object, or several",
    GraspStatus.FINGERS_IN_OBJECT: "with a finger in the object",
    GraspStatus.NO_MOTION: "without a motion",
    GraspStatus.UNLIKELY: "too unlikely to hold",
    GraspStatus.NO_LINE: "without a straight way in or out",
}
_NEARLY_ALL = 0.95
_REMEDIES: Mapping[GraspStatus, str] = {
    GraspStatus.UNREACHABLE: "Is the robot's base where you think it is, and the table within its reach?",
    GraspStatus.HITS_STATIC: "Are the height of the table, and the obstacles of the workspace, right?",
}


def why_none_is_valid(report: GraspReport) -> str:
    """Return the counts of the rejected grasps, most frequent first, and a remedy if nearly all fail for one reason."""
    if not report.object_ids:
        return "No object is in sight."
    total = len(report.status)
    if total == 0:
        return "No object in sight has a valid grasp: no way to grip any of them was found."
    counts = {status: int(np.count_nonzero(report.status == status)) for status in _WORDS}
    ranked = sorted((s for s in counts if counts[s]), key=lambda s: -counts[s])
    listed = ", ".join(f"{counts[s]} {_WORDS[s]}" for s in ranked)
    text = f"No object in sight has a valid grasp: of {total} grasps {listed}."
    nearly = [s for s in ranked if s in _REMEDIES and counts[s] >= _NEARLY_ALL * total]
    return f"{text} {_REMEDIES[nearly[0]]}" if nearly else text
