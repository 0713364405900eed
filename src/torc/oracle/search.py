"""The shortest sequence of picks. Independent of robots: tests run it on small made-up spaces.

Sequences are compared by picks, then by drops. The first one takes the first choice of every state, as a planner
without foresight would, so that the answer is no worse. Each further step takes the first of these that is possible:

1. the open choice that promises a better sequence (`torc.oracle.promise`), or a step of the search for more
   such promises, whichever may be shorter, about half and half;
2. the choice with the lowest bound, once the budget suffices for the rest of a proof;
3. a drawn sequence: from any open choice on to sets of objects that were not reached with as few picks.

This decides only the order of trials; proofs rest on bounds alone.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic

import numpy as np

from torc.oracle.promise import Promise
from torc.oracle.tree import Cost, Node, Path, Space, Spent, State, Tree, Trial

_FIRST_SHARE = 0.5
"""Share of the budget after which first choices are no longer followed."""
_PEEK_SHARE = 0.3
"""Share of the budget that peeks may take."""


@dataclass(frozen=True)
class Found(Generic[State]):
    """The answer so far.

    Attributes:
        best: the best sequence that ends with the target; None if there is none yet.
        bound: no sequence costs less; None if it is proved that no valid one ends with the target.
        rough_bound: picks that are needed at least if picks moved nothing else, as far as known; no proof.
        outlook: the most promising sequence that does not end with the target.
        spent: the effort so far.
        limit: most picks of a sequence, if there is no best and longer ones were not tried for that reason.
        likely: every sequence that would be better than the best if picks moved nothing else was tried.
    """

    best: Path[State] | None
    bound: Cost | None
    rough_bound: int
    outlook: Path[State]
    spent: Spent
    limit: int | None = None
    likely: bool = False

    @property
    def proved(self) -> bool:
        """True if `best` is proved the best, or it is proved that there is none."""
        return self.bound is None or (self.best is not None and self.best.cost <= self.bound)


def search(
    space: Space[State],
    start: State,
    *,
    max_picks: int,
    budget: float,
    likely_suffices: bool = False,
    tell: Callable[[Found[State]], None] | None = None,
) -> Found[State]:
    """Find the cheapest sequence of at most max_picks picks, or the best that the budget finds.

    The budget, in simulated picks, is never exceeded. With `likely_suffices` the search ends as soon as the best
    sequence is likely the best there is (`Found.likely`), unless the budget allows the proof. `tell` is called after
    every pick and look with the answer so far.
    """
    run: _Search[State]
    tell = tell or (lambda found: None)
    run = _Search(Tree(space, start, max_picks, budget, lambda: tell(run.found())))
    run.run(likely_suffices)
    return run.found()


class _Search(Generic[State]):
    def __init__(self, tree: Tree[State]) -> None:
        self.tree = tree
        self.promise: Promise[State] = Promise(tree, _PEEK_SHARE)
        self.rng = np.random.default_rng(0)
        self.reached: dict[frozenset[int], int] = {}
        """Sets of objects that were gone in a state, with the fewest picks that led there."""
        self.spent_on_promises = 0.0

    def run(self, likely_suffices: bool) -> None:
        tree = self.tree
        if not tree.affords(looks=1):
            return
        tree.look(tree.root)
        self.follow_first_choices()
        while tree.next() is not None and tree.affords(picks=1, looks=1):
            if likely_suffices and self.likely and not self.proof_in_reach():
                return
            self.advance()

    def found(self) -> Found[State]:
        tree = self.tree
        best = None if tree.best is None else tree.best.path()
        trial = tree.next()
        untried = [trial.bound] if trial is not None else [] if tree.looked else [Cost(1, 0)]
        bound = min([*untried, *([] if best is None else [best.cost])], default=None)
        rough = self.rough_bound() if bound is None else max(bound.picks, self.rough_bound())
        limit = tree.max_picks if best is None and tree.cut else None
        return Found(best, bound, rough, tree.leader.path(), tree.spent, limit, self.likely)

    def follow_first_choices(self) -> None:
        node: Node[State] | None = self.tree.root
        while node is not None and node.trials and self.tree.affords(picks=1, looks=1):
            if self.tree.spent.total > _FIRST_SHARE * self.tree.budget:
                return
            node = self.attempt(next(iter(node.trials.values())))

    def advance(self) -> None:
        trial = self.most_promising()
        prospect = None if trial is None else self.promise.of(trial)
        unknown = self.unknown_plans()
        # Neither the search for promises nor trying them should take much more of the budget than the other.
        unknown_first = unknown is not None and (
            prospect is None or (unknown < prospect.expected and self.promise.spent <= self.spent_on_promises)
        )
        if unknown_first and self.promise.affords_peek:
            self.promise.extend()
        elif trial is not None:
            before = self.tree.spent.total
            self.attempt(trial)
            self.spent_on_promises += self.tree.spent.total - before
        elif not self.proof_in_reach() and (trial := self.drawn(self.tree.open())) is not None:
            self.wander(trial)
        elif (trial := self.tree.next()) is not None:
            self.attempt(trial)

    def most_promising(self) -> Trial[State] | None:
        """Return the open choice that promises the least cost, if less than the best sequence costs.

        Choices that lead to a set of objects that was reached with as few picks come last.
        """
        hopeful = []
        for trial in self.tree.open():
            prospect = self.promise.of(trial)
            if prospect is not None and self.tree.hopeful(prospect.cost):
                again = self.reached.get(trial.gone, math.inf) <= trial.node.cost.picks + 1
                hopeful.append((again, prospect, -trial.node.cost.picks, trial.detour, trial.number, trial))
        return min(hopeful)[-1] if hopeful else None

    def unknown_plans(self) -> int | None:
        """Return the least picks of unknown rough plans; None if these are too many, or all plans are known."""
        picks = self.promise.rough_bound
        return picks if picks is not None and self.tree.hopeful(Cost(picks, 0)) else None

    @property
    def likely(self) -> bool:
        """True if nothing promises to be better than the best sequence."""
        return self.tree.best is not None and self.unknown_plans() is None and self.most_promising() is None

    def rough_bound(self) -> int:
        rough = self.promise.rough_bound or self.tree.max_picks
        return rough if self.tree.best is None else min(rough, self.tree.best.cost.picks)

    def proof_in_reach(self) -> bool:
        """True if each open choice needs one more pick to be settled, and the budget allows all of them."""
        if self.tree.best is None:
            return False
        left, last = self.tree.open(), self.tree.best.cost.picks - 1
        return all(t.bound.picks >= last for t in left) and self.tree.affords(len(left), len(left))

    def wander(self, trial: Trial[State] | None) -> None:
        """Go on from a choice by drawn choices, or the target if it can be picked."""
        while trial is not None and self.tree.affords(picks=1, looks=1):
            node = self.attempt(trial)
            left = [] if node is None else [t for t in node.trials.values() if self.tree.hopeful(t.bound)]
            trial = left[0] if left and left[0].is_target else self.drawn(left)

    def drawn(self, trials: Sequence[Trial[State]]) -> Trial[State] | None:
        """Draw a choice that may lead to a new set, more probably the more promising it is."""
        new = [t for t in trials if self.reached.get(t.gone, math.inf) > t.node.cost.picks + 1]
        if not new:
            return None
        weights = 1.0 / (1.0 + np.array([t.detour for t in new]))
        return new[self.rng.choice(len(new), p=weights / weights.sum())]

    def attempt(self, trial: Trial[State]) -> Node[State] | None:
        before = self.tree.best
        child = self.tree.attempt(trial)
        self.promise.learn(trial)
        if child is not None:
            picks = self.reached.get(child.gone, child.cost.picks)
            self.reached[child.gone] = min(picks, child.cost.picks)
        best = self.tree.best
        if best is not None and best is not before:
            picked = list(dict.fromkeys(k for k in best.path().choices if k in trial.node.gone))
            self.promise.shrink(picked)
            self.promise.shrink(picked[::-1])
        return child
