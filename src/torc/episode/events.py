"""The events of an episode, as they happen. A listener is any callable that takes an event."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from torc.pipeline.look import Look
from torc.pipeline.state import EndReason, EpisodeState
from torc.records import Decision, PickOutcome, PickPlan, PlanFailure


@dataclass(frozen=True)
class Started:
    """The episode begins.

    Attributes:
        names: of the objects by id; only simulators know them.
        absent: objects that fell off the table before the first pick; only simulators know them.
        vlm: the model that the planner asks, as on the command line.
        guard: what happens when a real robot touches something.
    """

    problem: str
    planner: str
    seed: int
    target_description: str
    max_picks: int
    names: tuple[str, ...] = ()
    absent: tuple[int, ...] = ()
    vlm: str = ""
    guard: str = ""


@dataclass(frozen=True)
class Looked:
    """A snapshot was taken and understood. `state` is the full state before the pick."""

    pick: int
    look: Look
    seconds: float
    state: EpisodeState


@dataclass(frozen=True)
class Decided:
    """The task planner answered."""

    pick: int
    look: Look
    decision: Decision
    seconds: float


@dataclass(frozen=True)
class Planned:
    """Motions were planned, or not. `ways`, for a real robot: TCP positions along each motion, world frame, metres."""

    pick: int
    look: Look
    plan: PickPlan | PlanFailure
    seconds: float
    ways: Mapping[str, tuple[tuple[float, float, float], ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Executed:
    """The attempt is over, whether or not the robot moved."""

    pick: int
    outcome: PickOutcome
    seconds: float


@dataclass(frozen=True)
class Halted:
    """A real robot was stopped within a pick, by itself, torc or a person.

    The pick has no result and does not count; if somebody resumed, another look follows.
    """

    pick: int
    reason: str


@dataclass(frozen=True)
class EpisodeResult:
    """The episode's outcome.

    Attributes:
        held_target: the target was held after the lift, which is the paper's own rule.
        outcomes: one per attempt.
        seconds: wall time by stage.
        halts: the reason for each stop of a real robot within a pick.
    """

    retrieved: bool
    held_target: bool
    end: EndReason
    outcomes: tuple[PickOutcome, ...]
    seconds: dict[str, float]
    halts: tuple[str, ...] = ()

    @property
    def picks(self) -> int:
        """Attempts used, including failed ones (the authors' rule)."""
        return len(self.outcomes)

    @property
    def dropped(self) -> tuple[int, ...]:
        """Ids of the objects other than the target that fell off the table."""
        return tuple(k for outcome in self.outcomes for k in outcome.dropped)


@dataclass(frozen=True)
class Ended:
    """The episode is over."""

    result: EpisodeResult


Event = Started | Looked | Decided | Planned | Executed | Halted | Ended
Listener = Callable[[Event], Any]
