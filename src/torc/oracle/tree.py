"""The tree that is searched: its states, the choices tried and open, and the consequences."""

import heapq
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Generic, Protocol, TypeVar

from torc.errors import InputError

State = TypeVar("State")
Choice = int | None
"""An object to pick, or None: to let a pick pass."""
GIVE_UP = -1
"""The choice to give up, for a target that is certainly absent. It ends a sequence like a pick of the target, and
counts as a pick within the search, so that the bounds hold unchanged.
"""
LOOK_COST = 0.5
"""Cost of a look, real or rough, in picks: about its share of the computing."""
DEFAULT_BUDGET = 80.0
"""In simulated picks, not seconds, so that the answer does not depend on a busy machine. At most some 40 seconds of one
2 GHz core; proves most answers of up to three picks.
"""


def check_budget(budget: float) -> None:
    """Raise InputError for a budget that is not a number or does not allow a single look."""
    if not LOOK_COST <= budget < float("inf"):
        raise InputError(
            f"The budget is {budget:g}; it must be a number of simulated picks, e.g. {DEFAULT_BUDGET:g}."
        )


class Fate(Enum):
    OPEN = "open"
    SOLVED = "solved"
    LOST = "lost"


@dataclass(frozen=True)
class Options:
    """What a look at a state shows.

    At least one more pick is needed if the target can be picked now, else at least two: all bounds follow from this.
    (They ignore a pick of something else that brings the target along by luck.)

    Attributes:
        choices: what can be picked, most promising first.
        target: which of them is the target.
        outlook: how near the retrieval looks, to compare states when nothing better is known.
        note: the situation in words.
    """

    choices: tuple[Choice, ...]
    target: int | None = None
    outlook: float = 0.0
    note: str = ""


@dataclass(frozen=True)
class Arrival(Generic[State]):
    """Where a pick leads: the state after it, how many objects it dropped, and the objects that left the table."""

    state: State
    dropped: int = 0
    fate: Fate = Fate.OPEN
    gone: frozenset[int] = frozenset()


class Space(Protocol[State]):
    """A space to search. Every method is deterministic."""

    def look(self, state: State) -> Options:
        """Return what can be done in a state."""

    def pick(self, state: State, choice: Choice) -> Arrival[State]:
        """Return what a choice leads to."""

    def peek(self, state: State, removed: frozenset[int]) -> Options:
        """Return what a look would show if these objects were gone from a state: a guess that costs no picks."""


@dataclass(frozen=True, order=True)
class Cost:
    """Cost of a sequence, or a lower bound of it: picks first, then drops."""

    picks: int
    drops: int


@dataclass(frozen=True)
class Spent:
    """Picks tried, and looks, rough ones included."""

    picks: int = 0
    looks: int = 0

    @property
    def total(self) -> float:
        return self.picks + LOOK_COST * self.looks


@dataclass(frozen=True)
class Path(Generic[State]):
    """A sequence of picks from the start, with the states and notes before each, and at the end ("" without a look)."""

    choices: tuple[Choice, ...]
    states: tuple[State, ...]
    notes: tuple[str, ...]
    cost: Cost


@dataclass
class Node(Generic[State]):
    """A state and how it was reached: the objects that have left the table since the start, how much its choices differ
    from the most promising ones, and a trial per choice that may still lead to something better.
    """

    state: State
    parent: "Node[State] | None" = None
    choice: Choice = None
    cost: Cost = field(default_factory=lambda: Cost(0, 0))
    gone: frozenset[int] = frozenset()
    detour: int = 0
    options: Options = field(default_factory=lambda: Options(()))
    trials: "dict[Choice, Trial[State]]" = field(default_factory=dict)

    def path(self) -> Path[State]:
        nodes = [self]
        while (parent := nodes[0].parent) is not None:
            nodes.insert(0, parent)
        notes = tuple(n.options.note for n in nodes)
        return Path(tuple(n.choice for n in nodes[1:]), tuple(n.state for n in nodes), notes, self.cost)


@dataclass(order=True)
class Trial(Generic[State]):
    """A choice that can be tried, ordered by its lower bound; `child` is the node it led to, if one can go on there."""

    bound: Cost
    detour: int
    number: int
    node: Node[State] = field(compare=False)
    choice: Choice = field(compare=False)
    done: bool = field(default=False, compare=False)
    child: Node[State] | None = field(default=None, compare=False)

    @property
    def is_target(self) -> bool:
        return self.choice is not None and self.choice == self.node.options.target

    @property
    def gone(self) -> frozenset[int]:
        """Objects gone after it, if it takes only its object away."""
        return self.node.gone if self.choice is None else self.node.gone | {self.choice}


class Tree(Generic[State]):
    """Everything that was tried from a start, within a budget. It knows what can still be tried, not what should be.

    `best` is the end of the best sequence, `leader` the most promising state that was looked at; with `cut` something
    was left untried because it needs too many picks.
    """

    def __init__(
        self, space: Space[State], start: State, max_picks: int, budget: float, tell: Callable[[], None]
    ) -> None:
        """Start at a state; `tell` is called after every pick and peek."""
        self.space, self.max_picks, self.budget, self.tell = space, max_picks, budget, tell
        self.root = self.leader = Node(start)
        self.best: Node[State] | None = None
        self.spent = Spent()
        self.cut = self.looked = False
        self._leader_outlook = -math.inf
        self._open: list[Trial[State]] = []
        self._numbers = itertools.count()
        self._peeked: dict[frozenset[int], Options] = {}

    def hopeful(self, cost: Cost) -> bool:
        return cost < (Cost(self.max_picks + 1, 0) if self.best is None else self.best.cost)

    def affords(self, picks: int = 0, looks: int = 0) -> bool:
        return self.spent.total + Spent(picks, looks).total <= self.budget

    def next(self) -> Trial[State] | None:
        """Return the open choice with the lowest bound that can still lead to something better."""
        while self._open and (self._open[0].done or not self.hopeful(self._open[0].bound)):
            heapq.heappop(self._open)
        return self._open[0] if self._open else None

    def open(self) -> list[Trial[State]]:
        """Return all choices that are open and can still lead to something better."""
        self._open = [t for t in self._open if not t.done and self.hopeful(t.bound)]
        heapq.heapify(self._open)
        return list(self._open)

    def attempt(self, trial: Trial[State]) -> Node[State] | None:
        """Try a choice. Returns the node that it leads to; None if nothing better can follow."""
        trial.done = True
        arrival = self.space.pick(trial.node.state, trial.choice)
        self.spent = Spent(self.spent.picks + 1, self.spent.looks)
        cost = Cost(trial.node.cost.picks + 1, trial.node.cost.drops + arrival.dropped)
        gone = trial.node.gone | arrival.gone
        node = Node(arrival.state, trial.node, trial.choice, cost, gone, trial.detour)
        if arrival.fate is Fate.SOLVED and self.hopeful(cost):
            self.best = node
        elif arrival.fate is Fate.OPEN:
            if self.hopeful(Cost(cost.picks + 1, cost.drops)):
                self.look(node)
                trial.child = node
            else:
                self.cut = True
        self.tell()
        return trial.child

    def look(self, node: Node[State]) -> None:
        self.spent = Spent(self.spent.picks, self.spent.looks + 1)
        self.looked = True
        node.options = self.space.look(node.state)
        if node.options.outlook > self._leader_outlook:
            self.leader, self._leader_outlook = node, node.options.outlook
        for rank, choice in enumerate(node.options.choices):
            needed = 1 if choice is not None and choice == node.options.target else 2
            bound = Cost(node.cost.picks + needed, node.cost.drops)
            if self.hopeful(bound):
                trial = Trial(bound, node.detour + rank, next(self._numbers), node, choice)
                node.trials[choice] = trial
                heapq.heappush(self._open, trial)
            else:
                self.cut = True

    def peek(self, removed: frozenset[int]) -> Options:
        """Return what a look at the start would show if these objects were gone. Costs a look, the first time."""
        if removed not in self._peeked:
            self.spent = Spent(self.spent.picks, self.spent.looks + 1)
            self._peeked[removed] = self.space.peek(self.root.state, removed)
            self.tell()
        return self._peeked[removed]
