"""The shortest sequence of picks, by branch and bound. Knows nothing of robots: tests run it on small made-up spaces.

Sequences are compared by picks, then by drops. The first one takes the first choice of every state, as a planner
without foresight would, so that the answer is no worse. Better ones come from rough plans
(`torc.episode.oracle.rough`), which are tried out; then the open choice with the lowest bound is tried, until nothing
that is open can beat the best sequence or the budget is spent. First choices and rough plans decide only what is tried
first; what is proved rests on the bounds alone.
"""

import heapq
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Generic

from torc.episode.oracle.budget import LOOK_COST
from torc.episode.oracle.found import NOTHING, Cost, Found, Path, Spent
from torc.episode.oracle.rough import RoughPlan, rough_plans
from torc.episode.oracle.space import Choice, Fate, Options, Space, State

_FIRST_SHARE = 0.5
"""Share of the budget after which first choices are no longer followed."""
_ROUGH_SHARE = 0.5
"""Share of the budget after which no more rough plans are made."""


def search(
    space: Space[State],
    start: State,
    *,
    max_picks: int,
    budget: float,
    likely_suffices: bool = False,
    tell: Callable[[Found[State]], None] | None = None,
) -> Found[State]:
    """The sequence of at most max_picks picks that costs least, or the best that the budget finds.

    Args:
        space: what to search.
        start: where from.
        max_picks: longer sequences do not count.
        budget: in picks; a look counts LOOK_COST. It is never exceeded.
        likely_suffices: end as soon as the best sequence is likely the best there is (`Found.likely`), unproved.
        tell: called after every pick and look with the answer so far.
    """
    run = _Search(space, start, max_picks, budget, likely_suffices, tell or (lambda found: None))
    run.run()
    return run.found()


@dataclass
class _Node(Generic[State]):
    """A state and how it was reached; `detour` counts by how much its choices differ from the most promising ones."""

    state: State
    parent: "_Node[State] | None" = None
    choice: Choice = None
    cost: Cost = NOTHING
    detour: int = 0
    options: Options = field(default_factory=lambda: Options(()))
    trials: "dict[Choice, _Trial[State]]" = field(default_factory=dict)

    def path(self) -> Path[State]:
        nodes = [self]
        while (parent := nodes[-1].parent) is not None:
            nodes.append(parent)
        nodes.reverse()
        return Path(
            choices=tuple(n.choice for n in nodes[1:]),
            states=tuple(n.state for n in nodes),
            notes=tuple(n.options.note for n in nodes),
            cost=self.cost,
        )


@dataclass(order=True)
class _Trial(Generic[State]):
    """A choice that can be tried, in the order in which to try; `child` is where it led, if one can go on there."""

    bound: Cost
    detour: int
    number: int
    node: _Node[State] = field(compare=False)
    choice: Choice = field(compare=False)
    done: bool = field(default=False, compare=False)
    child: _Node[State] | None = field(default=None, compare=False)


class _Search(Generic[State]):
    def __init__(
        self,
        space: Space[State],
        start: State,
        max_picks: int,
        budget: float,
        likely_suffices: bool,
        tell: Callable[[Found[State]], None],
    ) -> None:
        self.space, self.max_picks, self.budget, self.tell = space, max_picks, budget, tell
        self.likely_suffices = likely_suffices
        self.root = _Node(start)
        self.best: _Node[State] | None = None
        self.leader, self.leader_outlook = self.root, -math.inf
        self.open: list[_Trial[State]] = []
        self.numbers = itertools.count()
        self.spent = Spent()
        self.rough_bound, self.rough_known = 1, False
        self.looked = False
        self.cut = False
        """Something was left untried because it needs too many picks: more than max_picks, or than the best."""

    def run(self) -> None:
        if not self.affords(looks=1):
            return
        self.look(self.root)
        self.looked = True
        self.follow_first_choices()
        self.pursue_rough_plans()
        while (trial := self.next()) is not None and self.affords(picks=1, looks=1):
            if self.likely_suffices and self.found().likely:
                return
            child = self.attempt(trial)
            if child is not None and self.best is None:
                self.pursue(child)

    def found(self) -> Found[State]:
        best = None if self.best is None else self.best.path()
        costs = [] if best is None else [best.cost]
        if not self.looked:
            costs.append(Cost(1, 0))
        elif (trial := self.next()) is not None:
            costs.append(trial.bound)
        bound = min(costs, default=None)
        limit = self.max_picks if best is None and self.cut else None
        return Found(best, bound, self.rough_bound, self.leader.path(), self.spent, limit)

    def next(self) -> _Trial[State] | None:
        """The open choice with the lowest bound that can still lead to something better."""
        while self.open and (self.open[0].done or not self.hopeful(self.open[0].bound)):
            heapq.heappop(self.open)
        return self.open[0] if self.open else None

    def follow_first_choices(self) -> None:
        """Try the first choice of each state, from the start."""
        node: _Node[State] | None = self.root
        while node is not None and node.trials:
            if self.spent.total > _FIRST_SHARE * self.budget or not self.affords(picks=1, looks=1):
                return
            node = self.attempt(next(iter(node.trials.values())))

    def pursue_rough_plans(self) -> None:
        """Try out the rough plans from the start that would be better than the best sequence so far."""
        for rough in self.plans(self.root):
            if not self.rough_known:
                self.rough_bound, self.rough_known = rough.picks, rough.plan is not None
            if not self.hopeful(Cost(rough.picks, 0)):
                return
            if rough.plan is not None:
                self.pursue(self.root, rough.plan)
                if not self.hopeful(Cost(rough.picks, 0)):
                    return
        if self.best is None:
            self.pursue(self.root)

    def pursue(self, start: _Node[State], plan: tuple[Choice, ...] = ()) -> None:
        """Pick after pick: the target as soon as it can be picked, else by the plan.

        Where the plan cannot be followed, on by another one while no sequence to the target is known.
        """
        node: _Node[State] | None = start
        while node is not None and node.trials:
            target = node.options.target
            if target is not None and target in node.trials and not node.trials[target].done:
                plan = (target,)
            elif not plan or plan[0] not in node.trials:
                if self.best is not None:
                    return
                plan = self.rough_plan(node) or tuple(node.trials)[:1]
            trial, plan = node.trials[plan[0]], plan[1:]
            if not self.hopeful(trial.bound) or not self.affords(picks=1, looks=1):
                return
            node = trial.child if trial.done else self.attempt(trial)

    def rough_plan(self, node: _Node[State]) -> tuple[Choice, ...] | None:
        """The shortest rough plan from here, if there is one within reach."""
        for rough in self.plans(node):
            if not self.hopeful(Cost(node.cost.picks + rough.picks, node.cost.drops)):
                return None
            if rough.plan is not None:
                return rough.plan
        return None

    def plans(self, node: _Node[State]) -> Iterator[RoughPlan]:
        """Rough plans from a node, while the budget for them lasts."""

        def peek(removed: frozenset[int]) -> Options:
            self.spent = Spent(self.spent.picks, self.spent.looks + 1)
            options = self.space.peek(node.state, removed)
            self.tell(self.found())
            return options

        plans = rough_plans(peek, node.options)
        while self.spent.total + LOOK_COST <= _ROUGH_SHARE * self.budget:
            rough = next(plans, None)
            if rough is None:
                return
            yield rough

    def attempt(self, trial: _Trial[State]) -> _Node[State] | None:
        """Try a choice. Returns the node that it leads to; None if nothing better can come of going on there."""
        trial.done = True
        arrival = self.space.pick(trial.node.state, trial.choice)
        self.spent = Spent(self.spent.picks + 1, self.spent.looks)
        cost = Cost(trial.node.cost.picks + 1, trial.node.cost.drops + arrival.dropped)
        node = _Node(arrival.state, trial.node, trial.choice, cost, trial.detour)
        if arrival.fate is Fate.SOLVED and self.hopeful(cost):
            self.best = node
        elif arrival.fate is Fate.OPEN:
            if self.hopeful(Cost(cost.picks + 1, cost.drops)):
                self.look(node)
                trial.child = node
            else:
                self.cut = True
        self.tell(self.found())
        return trial.child

    def look(self, node: _Node[State]) -> None:
        """Find out what can be tried in a node."""
        self.spent = Spent(self.spent.picks, self.spent.looks + 1)
        node.options = self.space.look(node.state)
        if node.options.outlook > self.leader_outlook:
            self.leader, self.leader_outlook = node, node.options.outlook
        for rank, choice in enumerate(node.options.choices):
            needed = 1 if choice is not None and choice == node.options.target else 2
            bound = Cost(node.cost.picks + needed, node.cost.drops)
            if self.hopeful(bound):
                trial = _Trial(bound, node.detour + rank, next(self.numbers), node, choice)
                node.trials[choice] = trial
                heapq.heappush(self.open, trial)
            else:
                self.cut = True

    def hopeful(self, cost: Cost) -> bool:
        """Whether a sequence of this cost would be better than the best."""
        return cost < (Cost(self.max_picks + 1, 0) if self.best is None else self.best.cost)

    def affords(self, picks: int = 0, looks: int = 0) -> bool:
        """Whether the budget allows for more."""
        return self.spent.total + Spent(picks, looks).total <= self.budget
