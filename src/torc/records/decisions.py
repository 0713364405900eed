"""A task planner's input and its answer."""

from dataclasses import dataclass, field
from typing import Any

from torc.io.record_files import ASIDE, to_plain
from torc.records.evidence import Evidence
from torc.records.grasps import GraspReport, GraspSet, GraspStatus
from torc.records.outcomes import PickOutcome
from torc.records.scene import SegmentedScene
from torc.records.volume import OcclusionVolume


@dataclass(frozen=True)
class Hand:
    """What a sentence can say about a gripper: how far it opens, and the length of its fingers, metres."""

    opening_m: float
    finger_length_m: float


@dataclass(frozen=True)
class PlanningContext:
    """Everything that a task planner may see before a pick: nothing privileged, and equal for every planner.

    Attributes:
        scene: the objects in sight, their points in the world (metres), the picture and the camera.
        volume: the occlusion volume after this snapshot: which space was never seen, and what hides it.
        grasps: the grasp candidates of all objects.
        report: which candidates are valid, and which objects block the others.
        target_description: the target in words, e.g. "the blue tuna can".
        history: outcomes of the picks so far, as the robot felt them.
        picks_left: attempts left, this one included.
        labels: (object id, the user's label) pairs for a frame from outside; empty if there are only ids. A target that
            is out of sight has none.
        target_size_m: the target's length, corner to corner, and the width of the narrowest tube it passes through, as
            the user measured them, in metres; None if unknown.
        hand: the gripper; None if unknown.
    """

    scene: SegmentedScene
    volume: OcclusionVolume
    grasps: GraspSet
    report: GraspReport
    target_description: str
    history: tuple[PickOutcome, ...]
    picks_left: int
    labels: tuple[tuple[int, int], ...] = ()
    target_size_m: tuple[float, float] | None = None
    hand: Hand | None = None

    @property
    def graspable_ids(self) -> tuple[int, ...]:
        """Ids of the visible objects with a valid grasp, rising: what a planner may name."""
        return tuple(k for k in self.report.graspable_ids if k in self.scene.ids)

    def p(self, object_id: int) -> float:
        """Return the probability that the object's best valid grasp delivers it; 0 if it has no valid grasp."""
        valid = (self.grasps.object_ids == object_id) & (self.report.status == GraspStatus.VALID)
        return float(self.grasps.scores[valid].max(initial=0.0))

    def hidden_volume_m3(self, object_id: int) -> float:
        """Return the unseen volume that the object hides, in cubic metres."""
        return self.volume.hidden_volume_m3(object_id)

    def called(self, object_id: int) -> str:
        """Return how a reason names an object: the user's label, or the id without labels.

        An id without a label, which only a model makes up, becomes "number 7": it must not pass for a user's label.
        """
        if not self.labels:
            return str(object_id)
        label = dict(self.labels).get(object_id)
        return f"number {object_id}" if label is None else str(label)


@dataclass(frozen=True)
class Exchange:
    """One prompt to a model or person, and the reply, word for word."""

    prompt: str
    reply: str


@dataclass(frozen=True)
class Decision:
    """The answer of a task planner.

    Attributes:
        object_id: the object to pick next; None if the planner found no valid choice, which is a lost pick.
        reason: one or two sentences for people.
        attempts: how often a model or person was asked, 1 to 3.
        give_up: True ends the episode.
        is_target: True if the planner takes the object for the target although perception did not recognise it.
            Delivering it then ends the episode. Ignored where perception is given the true ids.
        exchanges: every prompt and reply.
        evidence: what the choice rests on, e.g. the dependency graph.
        pictures: PNG files that a model was sent, the same in every exchange; kept beside the log.
    """

    object_id: int | None
    reason: str
    attempts: int = 1
    give_up: bool = False
    is_target: bool = False
    exchanges: tuple[Exchange, ...] = ()
    evidence: Evidence = field(default_factory=Evidence)
    pictures: tuple[bytes, ...] = field(default=(), repr=False, metadata=ASIDE)

    def to_plain(self) -> dict[str, Any]:
        """Return JSON-compatible data without the pictures; `is_target` only if it is set."""
        plain = to_plain(self) | {"evidence": self.evidence.to_plain()}
        return plain if self.is_target else {k: v for k, v in plain.items() if k != "is_target"}
