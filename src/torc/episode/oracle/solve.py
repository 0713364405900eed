"""Finding the best order of picks for a problem."""

from collections.abc import Callable
from typing import Any

from torc.episode.oracle.answer import OracleAnswer, answer_from
from torc.episode.oracle.branches import Branches
from torc.episode.oracle.found import DEFAULT_BUDGET, Found, check_budget
from torc.episode.oracle.search import search
from torc.episode.privileged import Sandbox, SimulatedState, open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.pipeline.building import System
from torc.problems.problem import Problem

Say = Callable[[str], None]
_SAY_EVERY = 4.0


def solve_problem(
    problem: Problem,
    system: System,
    seed: int = 0,
    budget: float = DEFAULT_BUDGET,
    *,
    likely_suffices: bool = False,
    say: Say = lambda text: None,
) -> OracleAnswer:
    """The order of picks that retrieves the target with the fewest picks, then the fewest drops.

    A trial with the same seed that picks in this order goes exactly as foreseen.

    Args:
        problem: what stands on the table.
        system: what is simulated; longer orders than its conditions allow do not count.
        seed: of the trial; grasps and motions depend on it.
        budget: how much to try, in simulated picks (a look counts as half of one).
        likely_suffices: end with an order that is likely the best, unless the budget allows for the proof.
        say: told about progress.

    Raises:
        InputError: the budget is no positive number, or the problem cannot be played.
        PhysicsError: the simulation broke before the first pick.
    """
    check_budget(budget)
    max_picks = system.conditions.max_picks
    with open_sandbox(problem, system, EpisodeConfig(max_picks, seed)) as sandbox:
        found = best_order(sandbox, sandbox.begin(), max_picks, budget, say, likely_suffices=likely_suffices)
    return answer_from(found, problem, seed, budget)


def best_order(
    sandbox: Sandbox, start: SimulatedState, max_picks: int, budget: float, say: Say, *, likely_suffices: bool
) -> Found[SimulatedState]:
    """The best order of at most max_picks picks from a state on."""
    tell = _narration(say, budget)
    return search(
        Branches(sandbox),
        start,
        max_picks=max_picks,
        budget=budget,
        likely_suffices=likely_suffices,
        tell=tell,
    )


def _narration(say: Say, budget: float) -> Callable[[Found[Any]], None]:
    """Says a line when the answer gets better or the bound tighter, and now and then in between."""
    last: tuple[Any, ...] = ()
    next_spent = 0.0
    say(f"oracle: trying out orders of picks in a simulation of its own (budget {budget:g} picks)")

    def tell(found: Found[Any]) -> None:
        nonlocal last, next_spent
        news = (found.best and found.best.cost, found.bound)
        if news == last and found.spent.total < next_spent:
            return
        last, next_spent = news, found.spent.total + _SAY_EVERY
        cost = found.best and found.best.cost
        best = f"best {cost.picks} picks with {cost.drops} dropped" if cost else "none found yet"
        bound = "none possible" if found.bound is None else f"at least {found.bound.picks} needed"
        say(f"oracle: {best}, {bound} ({found.spent.total:.3g} of {budget:g} spent)")

    return tell
