"""What is searched: states, what can be picked in them, and where that leads."""

from dataclasses import dataclass
from enum import Enum
from typing import Generic, Protocol, TypeVar

State = TypeVar("State")
Choice = int | None
"""An object to pick, or None: to let a pick pass."""


class Fate(Enum):
    """Whether the picks go on."""

    OPEN = "open"
    SOLVED = "solved"
    LOST = "lost"


@dataclass(frozen=True)
class Options:
    """What a look at a state tells.

    At least one more pick is needed if the target can be picked now, else at least two: all bounds follow from this.
    (They do not reckon with a pick of something else that brings the target along by luck.)

    Attributes:
        choices: what can be picked, most promising first; the target is the first where it can be picked.
        target: the choice that is the target; None where it cannot be picked.
        outlook: how near the retrieval looks; compares states where nothing better is known.
        note: the situation in words.
    """

    choices: tuple[Choice, ...]
    target: int | None = None
    outlook: float = 0.0
    note: str = ""


@dataclass(frozen=True)
class Arrival(Generic[State]):
    """Where a pick leads: the state after it, how many objects it dropped, whether the picks go on, and the objects
    that left the table by it."""

    state: State
    dropped: int = 0
    fate: Fate = Fate.OPEN
    gone: frozenset[int] = frozenset()


class Space(Protocol[State]):
    """A space to search. Every method answers the same for the same arguments."""

    def look(self, state: State) -> Options:
        """What can be done in a state."""

    def pick(self, state: State, choice: Choice) -> Arrival[State]:
        """What comes of it."""

    def peek(self, state: State, removed: frozenset[int]) -> Options:
        """What a look would tell if these objects were gone from a state: a guess that costs no picks."""
