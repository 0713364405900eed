"""What a task planner sees and what it answers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from torc.records.grasps import GraspReport, GraspSet
from torc.records.outcomes import PickOutcome
from torc.records.scene import SegmentedScene
from torc.records.volume import OcclusionVolume


@dataclass(frozen=True)
class PlanningContext:
    """All that any task planner may see before a pick; nothing privileged: the same for every planner.

    Attributes:
        scene: the perceived scene.
        volume: the occlusion volume after this snapshot.
        grasps: candidate grasps.
        report: which are valid, and who blocks whom; `report.graspable_ids` is what a planner may name.
        target_description: the target in words, e.g. "the blue tuna can".
        history: outcomes of the picks so far, as the robot felt them.
        picks_left: attempts left, this one included.
    """

    scene: SegmentedScene
    volume: OcclusionVolume
    grasps: GraspSet
    report: GraspReport
    target_description: str
    history: tuple[PickOutcome, ...]
    picks_left: int


@dataclass(frozen=True)
class Exchange:
    """One prompt to a model or person, and the reply, word for word."""

    prompt: str
    reply: str


@dataclass(frozen=True)
class Decision:
    """The answer of a task planner.

    Attributes:
        object_id: the object to pick next, or None: the planner found no valid choice.
        reason: one or two sentences for people.
        attempts: how many times the chooser was asked (at most 3 per pick).
        give_up: True ends the episode.
        exchanges: every prompt and reply.
        evidence: plain data (JSON-compatible) that explains the choice, e.g. the dependency graph.
    """

    object_id: int | None
    reason: str
    attempts: int = 1
    give_up: bool = False
    exchanges: tuple[Exchange, ...] = ()
    evidence: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
