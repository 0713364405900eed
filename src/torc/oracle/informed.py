"""INFORMED: knows the scene, but not the draws of chance. What it needs more than ORACLE is luck."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from torc.episode.privileged import Sandbox, SimulatedState, Simulation
from torc.errors import InputError
from torc.oracle.solve import Say, best_order
from torc.oracle.tree import GIVE_UP, check_budget
from torc.pipeline.state import EndReason
from torc.records import TARGET_ID, Decision, Evidence, PickResult, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.dg_select import DgSelectPlanner

DEFAULT_BUDGET = 24.0
"""Of each search, in simulated picks: ORACLE finds its order with less, the rest of its budget is for proofs."""
_LARGEST_SEED = 2**31


@dataclass(frozen=True)
class Order:
    """Objects to pick, and the picks needed in independent simulations, in any order."""

    object_ids: tuple[int, ...]
    picks: tuple[int, ...]

    @property
    def expected(self) -> float:
        return float(np.mean(self.picks))


class InformedPlanner(TaskPlannerTraits):
    """Picks in the order that needs the fewest picks in expectation.

    It searches like ORACLE, in the true scene, but with other draws of grasps and motions than the trial's. Then it
    plays each order that it found, and DG-SELECT's choice, with more such draws, and takes the one with the fewest
    picks on average. It follows an order as long as each pick goes as expected.
    """

    name = "informed"
    reads_picture = False
    privileged = True

    def __init__(self, budget: float = DEFAULT_BUDGET, searches: int = 2, futures: int = 4) -> None:
        """Set the budget of each search, in simulated picks, the number of searches, each with its own draws, and how
        often each order is played to find its picks.
        """
        check_budget(budget)
        if searches < 1 or futures < 1:
            raise InputError("INFORMED needs at least one search and one future.")
        self.budget, self.searches, self.futures = budget, searches, futures
        self._simulation: Simulation | None = None
        self._rest: tuple[int, ...] = ()

    def attach(self, simulation: Simulation) -> None:
        self._simulation, self._rest = simulation, ()

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object of the best order. Raises InputError without a simulation."""
        if self._simulation is None:
            raise InputError(
                "The planner 'informed' tries picks out in the simulation, so it decides in simulated trials only: "
                "torc run --planner informed."
            )
        simulation = self._simulation
        if simulation.sandbox.nowhere(simulation.now(), context):
            return Decision(None, "The target is not there: no unseen place is left for it.", give_up=True)
        graspable = context.graspable_ids
        if not graspable:
            return Decision(None, "No visible object has a valid grasp.")
        went_well = bool(context.history) and context.history[-1].result is PickResult.REMOVED
        if went_well and self._rest and self._rest[0] in graspable:
            chosen, self._rest = self._rest[0], self._rest[1:]
            return Decision(
                chosen, f"Pick {context.called(chosen)}: next in the order, which goes as it should."
            )
        orders = self._weighed(simulation, context, rng)
        best = min(orders, key=lambda order: order.expected)
        chosen, self._rest = best.object_ids[0], best.object_ids[1:]
        played = [{"objects": list(o.object_ids), "expected_picks": o.expected} for o in orders]
        reason = (
            f"Pick {context.called(chosen)}: first of {len(best.object_ids)} that take {best.expected:.1f} "
            f"picks on average; {len(orders)} orders were played with {self.futures} draws of chance each."
        )
        return Decision(chosen, reason, evidence=Evidence(notes={"orders": played}))

    def _weighed(
        self, simulation: Simulation, context: PlanningContext, rng: np.random.Generator
    ) -> list[Order]:
        """Return the orders that begin with a graspable object, with the picks that each takes."""
        now, config, graspable = simulation.now(), simulation.config, context.graspable_ids
        left = config.max_picks - now.episode.pick
        draws = _other_seeds(rng, self.searches + self.futures, config.seed)
        sandboxes = [simulation.sandbox.with_draws(seed) for seed in draws]
        first = DgSelectPlanner().decide(context, rng).object_id
        orders: set[tuple[int, ...]] = {(first,)} if first is not None else set()
        for sandbox in sandboxes[: self.searches]:
            orders.add(_order_in(sandbox, now, left, self.budget, simulation.say))
        if TARGET_ID in graspable:
            orders.add((TARGET_ID,))
        useful = sorted(order for order in orders if order and order[0] in graspable)
        return [
            Order(order, tuple(picks_of(order, s, now, left) for s in sandboxes[self.searches :]))
            for order in useful
        ]


def picks_of(order: Sequence[int], sandbox: Sandbox, start: SimulatedState, left: int) -> int:
    """Return the picks until the target is retrieved, or certainly absent; `left` if never.

    The player begins with the order's first object and follows the order, takes the target as soon as it can be picked,
    and takes DG-SELECT's choice when the order has nothing to offer.
    """
    state, rest = start, list(order)
    for pick in range(left):
        look = sandbox.look(state)
        if sandbox.nowhere(state, look.context):
            return pick
        graspable = look.context.graspable_ids
        wanted = ([TARGET_ID] if pick > 0 else []) + rest
        chosen = next((k for k in wanted if k in graspable), None)
        if chosen is None:
            # DG-SELECT draws nothing.
            chosen = DgSelectPlanner().decide(look.context, np.random.default_rng(0)).object_id
        state = sandbox.pick(state, look, chosen)
        if state.episode.end is EndReason.RETRIEVED:
            return pick + 1
        if state.episode.end is not None:
            return left
        outcome = state.episode.outcomes[-1]
        rest = [k for k in rest if k != outcome.held_id or not outcome.delivered]
    return left


def _order_in(sandbox: Sandbox, now: SimulatedState, left: int, budget: float, say: Say) -> tuple[int, ...]:
    """Return the objects of the best order that a search finds, each once."""
    found = best_order(sandbox, now, left, budget, say, likely_suffices=True)
    choices = (found.best or found.outlook).choices
    return tuple(dict.fromkeys(k for k in choices if k not in (None, GIVE_UP)))


def _other_seeds(rng: np.random.Generator, count: int, own: int) -> list[int]:
    """Return seeds other than the trial's own, whose draws nobody can know."""
    seeds: list[int] = []
    while len(seeds) < count:
        seed = int(rng.integers(_LARGEST_SEED))
        if seed != own and seed not in seeds:
            seeds.append(seed)
    return seeds
