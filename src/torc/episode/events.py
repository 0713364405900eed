"""What happens during an episode, as it happens. A listener is any callable that takes an event."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from torc.pipeline.look import Look
from torc.records import Decision, PickOutcome, PickPlan, PlanFailure


class EndReason(StrEnum):
    """Why an episode ended."""

    RETRIEVED = "retrieved"
    BUDGET_SPENT = "budget spent"
    TARGET_LOST = "target lost"
    NOTHING_LEFT = "nothing left to try"
    GAVE_UP = "gave up"


@dataclass(frozen=True)
class Started:
    """The episode begins. `names` are the objects' names by id, known to simulators only."""

    problem: str
    planner: str
    seed: int
    target_description: str
    max_picks: int
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Looked:
    """A snapshot was taken and understood."""

    pick: int
    look: Look
    seconds: float


@dataclass(frozen=True)
class Decided:
    """The task planner answered."""

    pick: int
    look: Look
    decision: Decision
    seconds: float


@dataclass(frozen=True)
class Planned:
    """Motions were planned, or not."""

    pick: int
    look: Look
    plan: PickPlan | PlanFailure
    seconds: float


@dataclass(frozen=True)
class Executed:
    """The attempt is over, whether or not the robot moved."""

    pick: int
    outcome: PickOutcome
    seconds: float


@dataclass(frozen=True)
class EpisodeResult:
    """The episode's outcome.

    Attributes:
        retrieved: the target was held after the lift and delivered.
        held_target: the paper's own rule: the target was held after the lift.
        end: why it ended.
        outcomes: one per attempt.
        seconds: wall time by stage.
    """

    retrieved: bool
    held_target: bool
    end: EndReason
    outcomes: tuple[PickOutcome, ...]
    seconds: dict[str, float]

    @property
    def picks(self) -> int:
        """Attempts used; failed ones count (as the paper's authors count)."""
        return len(self.outcomes)

    @property
    def dropped(self) -> tuple[int, ...]:
        """Ids of the objects other than the target that fell off the table."""
        return tuple(k for outcome in self.outcomes for k in outcome.dropped)


@dataclass(frozen=True)
class Ended:
    """The episode is over."""

    result: EpisodeResult


Event = Started | Looked | Decided | Planned | Executed | Ended
Listener = Callable[[Event], Any]
