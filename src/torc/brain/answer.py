"""The decision for a frame, what it rests on, and the grasps of an object: those to try now, and why not the others."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float

from torc.drawing.belief_picture import draw_belief
from torc.drawing.graph_picture import draw_decision
from torc.drawing.marking import mark_image
from torc.io.pictures import write_png
from torc.pipeline.look import Look
from torc.records import TARGET_ID, Decision, Evidence, GraspStatus, PlanningContext

HIDDEN = "hidden"
"""The label of a target that no frame has shown."""
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


class Sought(StrEnum):
    """How perception knew which object is the target."""

    LABEL = "label"
    MARK = "mark"
    PICTURES = "reference pictures"
    WORDS = "description"
    NOTHING = "nothing"


@dataclass(frozen=True)
class Answer:
    """The decision for a frame, and what it rests on.

    Attributes:
        decision: the planner's decision. `object_id` and `evidence` use torc's ids; the
            reason uses the frame's labels, provided the planner writes `context.called(object_id)`.
        look: everything that was perceived and planned. Pass `look.context.volume` to the next call.
        labels: the frame's label of each id.
        names: the frame's name of each id that has one.
        eyes: name of the perception that found the objects.
        sought: how perception knew which object is the target.
        pose_estimated: True if the camera's pose was estimated from the picture; grasps are then not in a robot's base
            frame.
        warnings: messages for the user: how the frame was understood, and what looks wrong in it.
    """

    decision: Decision
    look: Look
    labels: Mapping[int, int]
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    eyes: str = "labels"
    sought: Sought = Sought.LABEL
    pose_estimated: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def label(self) -> int | None:
        """The label of the object to pick next; None without a choice."""
        return None if self.decision.object_id is None else self.labels[self.decision.object_id]

    @property
    def grasps(self) -> tuple[Grasp, ...]:
        """The valid grasps of the chosen object, most probable first; empty without a choice."""
        chosen = self.decision.object_id
        return () if chosen is None else valid_grasps(self.look.context, chosen)

    @property
    def left_out(self) -> tuple[int, ...]:
        """Labels of the frame with too few pixels or depth readings to be objects."""
        ids = self.look.context.scene.ids
        return tuple(sorted(label for k, label in self.labels.items() if k not in ids))

    @property
    def sureness(self) -> dict[int, float]:
        """By id, the probability that a mask is exactly one object, if perception found the masks."""
        return {k.id: float(k.sureness) for k in self.look.context.scene.known}

    @property
    def target_p(self) -> dict[int, float]:
        """By id, the probability that an object is the target, if pictures or words describe it."""
        told = {k.id: k.target_p for k in self.look.context.scene.known if k.id in self.labels}
        return told if self.sought in (Sought.PICTURES, Sought.WORDS) else {}

    @property
    def ids(self) -> tuple[int, ...]:
        """Ids of the objects in sight, by rising label."""
        return tuple(sorted(self.look.context.scene.ids, key=lambda k: self.labels[k]))

    def to_dict(self) -> dict[str, Any]:
        """Return JSON-compatible data in labels: the choice, its grasps, why, and the state of each object's grasps.

        Only `id`, beside each object's label, is torc's own number: a VLM is shown it and answers with it
        (`exchanges`), and a user-defined planner may use it.
        """
        decision, target_id = self.decision.to_plain(), self.look.context.scene.target_id
        del decision["object_id"]
        decision["evidence"] = evidence_in_labels(self.decision.evidence, self.labels)
        return {
            "label": self.label,
            "grasps": [grasp.to_dict() for grasp in self.grasps],
            "grasp_frame": GRASP_FRAME,
            "pose_estimated": self.pose_estimated,
            **decision,
            "eyes": self.eyes,
            "target_sought_by": str(self.sought),
            "target": HIDDEN if target_id is None else self.labels[target_id],
            "target_visible": target_id is not None,
            "objects": [self._object(k) for k in self.ids],
            "left_out": list(self.left_out),
            "warnings": list(self.warnings),
            "seconds": {name: round(s, 4) for name, s in self.look.seconds.items()},
        }

    def save_pictures(self, directory: Path) -> None:
        """Write seen.png (the marked image) and, if the planner has them, graph.png and belief.png, numbered by label.

        Pictures that a model was sent become sent_1.png and so on; the numbers in them are torc's own.
        """
        chosen, labels = self.decision.object_id, self.labels
        seen = mark_image(self.look.context.scene, highlight=chosen, labels=labels)
        write_png(directory / "seen.png", seen)
        for number, picture in enumerate(self.decision.pictures, start=1):
            (directory / f"sent_{number}.png").write_bytes(picture)
        graph = draw_decision(self.decision, labels)
        if graph is not None:
            write_png(directory / "graph.png", graph)
        belief = draw_belief(self.decision, self.look.context.scene, labels)
        if belief is not None:
            write_png(directory / "belief.png", belief)

    def _object(self, object_id: int) -> dict[str, Any]:
        context = self.look.context
        return {
            "label": self.labels[object_id],
            "id": object_id,
            **({"name": self.names[object_id]} if object_id in self.names else {}),
            "pixels": context.scene.object(object_id).pixel_count,
            **({"sureness": round(self.sureness[object_id], 3)} if object_id in self.sureness else {}),
            **({"target_p": round(self.target_p[object_id], 3)} if object_id in self.target_p else {}),
            "valid_grasps": int(context.report.valid_total[context.report.object_ids.index(object_id)]),
            "grasps": {s.name.lower(): n for s, n in status_counts(context, object_id).items()},
            "blocked_by": {str(self.labels[k]): n for k, n in blockers_of(context, object_id).items()},
            "hides_m3": round(context.volume.hidden_volume_m3(object_id), 6),
        }


def evidence_in_labels(evidence: Evidence, labels: Mapping[int, int]) -> dict[str, Any]:
    """Return the evidence as JSON-compatible data, with the frame's labels in place of object ids.

    A planner's notes are unchanged.
    """

    def label(object_id: int) -> int | str:
        return labels.get(object_id, HIDDEN if object_id == TARGET_ID else object_id)

    def by_label(values: Mapping[int, float]) -> dict[str, float]:
        return {str(label(k)): v for k, v in values.items()}

    plain = evidence.to_plain()
    if evidence.graph is not None:
        graph = plain["graph"]
        graph["target"] = label(graph["target"])
        for node in graph["nodes"]:
            node["id"] = label(node["id"])
        for edge in graph["edges"]:
            edge |= {"source": label(edge["source"]), "target": label(edge["target"])}
    if evidence.probabilities:
        plain["probabilities"] = by_label(evidence.probabilities)
    if evidence.certainty is not None:
        plain["certainty"]["upper"] = by_label(evidence.certainty.upper)
    if (belief := evidence.belief) is not None:
        plain["belief"]["order"] = [label(k) for k in belief.order]
        for name in ("reveals", "behind", "hidden_by", "prices", "suspects"):
            if getattr(belief, name):
                plain["belief"][name] = by_label(getattr(belief, name))
    return plain
