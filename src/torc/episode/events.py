"""What happens during an episode, as it happens. A listener is any callable that takes an event."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from torc.pipeline.look import Look
from torc.pipeline.state import EndReason, EpisodeState
from torc.records import Decision, PickOutcome, PickPlan, PlanFailure


@dataclass(frozen=True)
class Started:
    """The episode begins. Only simulators know `names` of the objects by id, and which are `absent` because they fell
    off the table before the first pick; `vlm` is the model that the planner asks, as on the command line; `guard` says,
    of a real robot, what happens when it touches something.
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
    """A snapshot was taken and understood. `state` is that before the pick, for those who may know all of it."""

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
    """Motions were planned, or not. `ways`, of a real robot: the places of the TCP along each motion, world frame,
    metres.
    """

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
    """A real robot was stopped within a pick, by itself, torc or a person. The pick has no result and does not count;
    if somebody resumed, another look follows.
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
        halts: why a real robot was stopped within a pick, each time.
    """

    retrieved: bool
    held_target: bool
    end: EndReason
    outcomes: tuple[PickOutcome, ...]
    seconds: dict[str, float]
    halts: tuple[str, ...] = ()

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


Event = Started | Looked | Decided | Planned | Executed | Halted | Ended
Listener = Callable[[Event], Any]
