"""What has been tried: a tree of states, what is open in it, and what follows for the answer."""

import heapq
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic

from torc.episode.oracle.found import Cost, Path, Spent
from torc.episode.oracle.space import Choice, Fate, Options, Space, State


@dataclass
class Node(Generic[State]):
    """A state and how it was reached: objects that have left the table since the start, by how much its choices differ
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
        """How it was reached from the start."""
        nodes = [self]
        while (parent := nodes[-1].parent) is not None:
            nodes.append(parent)
        nodes.reverse()
        choices = tuple(n.choice for n in nodes[1:])
        notes = tuple(n.options.note for n in nodes)
        return Path(choices, tuple(n.state for n in nodes), notes, self.cost)


@dataclass(order=True)
class Trial(Generic[State]):
    """A choice that can be tried, ordered by its lower bound; `child` is where it led, if one can go on there."""

    bound: Cost
    detour: int
    number: int
    node: Node[State] = field(compare=False)
    choice: Choice = field(compare=False)
    done: bool = field(default=False, compare=False)
    child: Node[State] | None = field(default=None, compare=False)

    @property
    def is_target(self) -> bool:
        """The target is picked."""
        return self.choice is not None and self.choice == self.node.options.target

    @property
    def gone(self) -> frozenset[int]:
        """What is gone after it if it takes its object away and nothing else."""
        return self.node.gone if self.choice is None else self.node.gone | {self.choice}


class Tree(Generic[State]):
    """All that was tried from a start, within a budget. It says what can still be tried, not what should be.

    Attributes:
        best: the end of the best sequence.
        leader: the most promising state that was looked at.
        cut: something was left untried because it needs too many picks.
    """

    def __init__(
        self, space: Space[State], start: State, max_picks: int, budget: float, tell: Callable[[], None]
    ) -> None:
        """tell: called after every pick and peek."""
        self.space, self.max_picks, self.budget, self.tell = space, max_picks, budget, tell
        self.root = Node(start)
        self.best: Node[State] | None = None
        self.leader, self._leader_outlook = self.root, -math.inf
        self.spent = Spent()
        self.cut = False
        self.looked = False
        self._open: list[Trial[State]] = []
        self._numbers = itertools.count()
        self._peeked: dict[frozenset[int], Options] = {}

    def hopeful(self, cost: Cost) -> bool:
        """Whether a sequence of this cost would be better than the best."""
        return cost < (Cost(self.max_picks + 1, 0) if self.best is None else self.best.cost)

    def affords(self, picks: int = 0, looks: int = 0) -> bool:
        """Whether the budget allows for more."""
        return self.spent.total + Spent(picks, looks).total <= self.budget

    def next(self) -> Trial[State] | None:
        """The open choice with the lowest bound that can still lead to something better."""
        while self._open and (self._open[0].done or not self.hopeful(self._open[0].bound)):
            heapq.heappop(self._open)
        return self._open[0] if self._open else None

    def open(self) -> list[Trial[State]]:
        """All such choices."""
        self._open = [t for t in self._open if not t.done and self.hopeful(t.bound)]
        heapq.heapify(self._open)
        return list(self._open)

    def attempt(self, trial: Trial[State]) -> Node[State] | None:
        """Try a choice. Returns the node that it leads to; None if nothing better can come of going on there."""
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
        """Find out what can be tried in a node."""
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
        """What a look at the start would tell if these objects were gone. Costs a look, the first time."""
        if removed not in self._peeked:
            self.spent = Spent(self.spent.picks, self.spent.looks + 1)
            self._peeked[removed] = self.space.peek(self.root.state, removed)
            self.tell()
        return self._peeked[removed]
