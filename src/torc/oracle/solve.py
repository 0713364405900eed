"""Find the best order of picks for a problem: each attempt is simulated as in a trial."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from torc.episode.privileged import Sandbox, SimulatedState, open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import PhysicsError
from torc.oracle.answer import OracleAnswer, answer_from
from torc.oracle.search import Found, search
from torc.oracle.tree import DEFAULT_BUDGET, GIVE_UP, Arrival, Choice, Fate, Options, check_budget
from torc.pipeline.building import System
from torc.pipeline.look import Look
from torc.pipeline.state import EndReason
from torc.problems.problem import Problem
from torc.records import TARGET_ID, GraspStatus, PlanningContext
from torc.task_planning.dg_select import DgSelectPlanner

Say = Callable[[str], None]
MAX_PICKS = 15
"""Picks of a retrieval without luck, in which each pick takes its object away."""
_SAY_EVERY = 4.0
_NOWHERE = "the target can be nowhere"
_LOOKS_KEPT = 12
"""Looks kept in memory; each takes some 10 MB."""


def solve_problem(
    problem: Problem,
    system: System,
    seed: int = 0,
    budget: float = DEFAULT_BUDGET,
    *,
    likely_suffices: bool = False,
    say: Say = lambda text: None,
) -> OracleAnswer:
    """Find the order of picks that retrieves the target with the fewest picks, then the fewest drops.

    Orders longer than the conditions allow do not count. A trial with this seed, which decides all random draws, goes
    exactly as foreseen if it picks in this order. The budget is in simulated picks; a look counts as half of one.
    `likely_suffices` is that of `search`. Raises InputError if the budget is not a positive number, or the problem
    cannot be played; PhysicsError if the simulation broke before the first pick.
    """
    check_budget(budget)
    max_picks = system.conditions.max_picks
    with open_sandbox(problem, system, EpisodeConfig(max_picks, seed)) as sandbox:
        found = best_order(sandbox, sandbox.begin(), max_picks, budget, say, likely_suffices=likely_suffices)
    return answer_from(found, problem, seed, budget)


def best_order(
    sandbox: Sandbox, start: SimulatedState, max_picks: int, budget: float, say: Say, *, likely_suffices: bool
) -> Found[SimulatedState]:
    """Return the best order of at most max_picks picks from a state on."""
    # Giving up is not a pick.
    max_picks += sandbox.absent
    tell, space = _narration(say, budget), Branches(sandbox)
    return search(
        space, start, max_picks=max_picks, budget=budget, likely_suffices=likely_suffices, tell=tell
    )


class Branches:
    """The search space of an episode: everything the robot can pick, from any state on."""

    def __init__(self, sandbox: Sandbox) -> None:
        self._sandbox = sandbox
        self._looks: OrderedDict[int, tuple[SimulatedState, Look]] = OrderedDict()

    def look(self, state: SimulatedState) -> Options:
        return self._options(state, self._look(state).context)

    def pick(self, state: SimulatedState, choice: Choice) -> Arrival[SimulatedState]:
        """Return what a pick leads to. One that breaks the simulation leads nowhere."""
        if choice == GIVE_UP:
            return Arrival(state, fate=Fate.SOLVED)
        try:
            after = self._sandbox.pick(state, self._look(state), choice)
        except PhysicsError:
            return Arrival(state, fate=Fate.LOST)
        fate = {None: Fate.OPEN, EndReason.RETRIEVED: Fate.SOLVED}.get(after.episode.end, Fate.LOST)
        outcome = after.episode.outcomes[-1]
        delivered = () if outcome.held_id is None or not outcome.delivered else (outcome.held_id,)
        return Arrival(after, len(outcome.dropped), fate, frozenset((*delivered, *outcome.dropped)))

    def peek(self, state: SimulatedState, removed: frozenset[int]) -> Options:
        try:
            context = self._sandbox.look_without(state, removed).context
            # The world is as it would be then.
            return self._options(self._sandbox.now(state), context)
        except PhysicsError:
            return Options(())

    def _options(self, state: SimulatedState, context: PlanningContext) -> Options:
        options = options_of(context)
        if not self._sandbox.nowhere(state, context):
            return options
        choices = (GIVE_UP, *options.choices)
        return replace(options, choices=choices, target=GIVE_UP, outlook=options.outlook + 2.0, note=_NOWHERE)

    def _look(self, state: SimulatedState) -> Look:
        """Return the look at a state; it is repeated, with the same result, if it was long ago."""
        key = id(state)
        if key not in self._looks:
            # The state is kept too, so that its id is not reused.
            self._looks[key] = state, self._sandbox.look(state)
            if len(self._looks) > _LOOKS_KEPT:
                self._looks.popitem(last=False)
        self._looks.move_to_end(key)
        return self._looks[key][1]


def options_of(context: PlanningContext) -> Options:
    """Return the visible objects that have a valid grasp, the target first, then by the dependency graph.

    If none has one, a pick can only pass.
    """
    graspable, target_seen = context.graspable_ids, context.scene.target_id is not None
    target = TARGET_ID if TARGET_ID in graspable else None
    choices: tuple[Choice, ...] = (None,) if context.scene.objects else ()
    if graspable:
        # DG-SELECT draws nothing.
        first = DgSelectPlanner().decide(context, np.random.default_rng(0))
        p = first.evidence.probabilities
        places = [(k != TARGET_ID, k != first.object_id, -p.get(k, 0.0), k) for k in graspable]
        choices = tuple(k for *_, k in sorted(places))
    outlook = 2.0 * (target is not None) + target_seen + float(np.mean(context.volume.seen))
    note = "the target is hidden"
    if target_seen:
        note = "the target is in sight, " + ("and can be picked" if target is not None else "but blocked")
    return Options(choices, target, outlook, note)


def best_hold(context: PlanningContext, object_id: int) -> float:
    """Return the probability that the object's best valid grasp holds; 0 without a valid grasp."""
    valid = context.report.status == GraspStatus.VALID
    scores = context.grasps.scores[valid & (context.grasps.object_ids == object_id)]
    return float(scores.max(initial=0.0))


def _narration(say: Say, budget: float) -> Callable[[Found[Any]], None]:
    """Say a line when the answer gets better or the bound tighter, and now and then in between."""
    last: tuple[Any, ...] = ()
    next_spent = 0.0
    say(f"oracle: trying out orders of picks in a simulation of its own (budget {budget:g} picks)")

    def tell(found: Found[Any]) -> None:
        nonlocal last, next_spent
        cost = found.best and found.best.cost
        if (cost, found.bound) == last and found.spent.total < next_spent:
            return
        last, next_spent = (cost, found.bound), found.spent.total + _SAY_EVERY
        best = f"best {cost.picks} picks with {cost.drops} dropped" if cost else "none found yet"
        bound = "none possible" if found.bound is None else f"at least {found.bound.picks} needed"
        say(f"oracle: {best}, {bound} ({found.spent.total:.3g} of {budget:g} spent)")

    return tell
