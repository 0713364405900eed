"""The grasps of an object: those that can be tried now, best first, and why the others cannot."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float

from torc.records import GraspStatus, PlanningContext

GRASP_FRAME = (
    "T_world_tcp takes points of the grasp's frame to the world's, metres. Its origin is the tool centre point, midway "
    "between the tips of the pads when they touch the object; x is the closing direction, z the approach, out of the "
    "gripper."
)
"""The frame that grasps are given in."""
STATUS_WORDS: Mapping[GraspStatus, str] = MappingProxyType(
    {
        GraspStatus.VALID: "valid",
        GraspStatus.BLOCKED: "blocked",
        GraspStatus.UNREACHABLE: "out of reach",
        GraspStatus.HITS_STATIC: "into something fixed or never seen",
        GraspStatus.SEVERAL_OBJECTS: "not around exactly one object",
        GraspStatus.FINGERS_IN_OBJECT: "with a finger inside the object",
        GraspStatus.UNLIKELY: "too unlikely to succeed now",
        GraspStatus.NO_LINE: "without a straight way to them and up again",
        GraspStatus.NO_MOTION: "without a motion to them",
    }
)
"""In the order in which they are reported."""


@dataclass(frozen=True)
class Grasp:
    """A grasp that can be tried now.

    Attributes:
        T_world_tcp: pose of the grasp frame in the world, (4, 4), metres. Its origin is midway between the tips of the
            pads when they touch the object; x is the closing direction, z the approach, out of the gripper.
        width_m: distance between the pads when they touch the object, metres.
        p: probability that the object is delivered to the bin.
    """

    T_world_tcp: Float[np.ndarray, "4 4"]
    width_m: float
    p: float

    def to_dict(self) -> dict[str, Any]:
        """Return JSON-compatible data, lengths rounded to a hundredth of a millimetre."""
        pose, width_m, p = self.T_world_tcp.round(6).tolist(), round(self.width_m, 5), round(self.p, 4)
        return {"T_world_tcp": pose, "width_m": width_m, "p": p}


def valid_grasps(context: PlanningContext, object_id: int) -> tuple[Grasp, ...]:
    """Return the object's valid grasps, the most probable first."""
    grasps, status = context.grasps, context.report.status
    return tuple(
        Grasp(grasps.Ts_world_tcp[i], float(grasps.widths_m[i]), float(grasps.scores[i]))
        for i in grasps.of(object_id)
        if status[i] == GraspStatus.VALID
    )


def status_counts(context: PlanningContext, object_id: int) -> dict[GraspStatus, int]:
    """Count the object's grasps by status; statuses without grasps are left out."""
    status = context.report.status[context.grasps.object_ids == object_id]
    counts = {s: int(np.count_nonzero(status == s)) for s in STATUS_WORDS}
    return {s: n for s, n in counts.items() if n}


def blockers_of(context: PlanningContext, object_id: int) -> dict[int, int]:
    """Count, by id of each other object, the grasps of this object that it blocks; a grasp may count for several."""
    report = context.report
    row = report.blocking[report.object_ids.index(object_id)]
    return {other: int(n) for other, n in zip(report.object_ids, row) if n}
