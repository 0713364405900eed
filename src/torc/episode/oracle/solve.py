"""Finding the best order of picks for a problem."""

from collections.abc import Callable

from torc.episode.oracle.answer import OracleAnswer, answer_from
from torc.episode.oracle.branches import Branches
from torc.episode.oracle.budget import DEFAULT_BUDGET, check_budget
from torc.episode.oracle.found import Found
from torc.episode.oracle.narration import Narration
from torc.episode.oracle.search import search
from torc.episode.privileged import Moment, Sandbox, open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.pipeline.building import System
from torc.problems.problem import Problem


def solve_problem(
    problem: Problem,
    system: System,
    seed: int = 0,
    budget: float = DEFAULT_BUDGET,
    *,
    likely_suffices: bool = False,
    say: Callable[[str], None] = lambda text: None,
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
    sandbox: Sandbox,
    start: Moment,
    max_picks: int,
    budget: float,
    say: Callable[[str], None],
    *,
    likely_suffices: bool,
) -> Found[Moment]:
    """The best order of at most max_picks picks from some moment on."""
    return search(
        Branches(sandbox),
        start,
        max_picks=max_picks,
        budget=budget,
        likely_suffices=likely_suffices,
        tell=Narration(say, budget),
    )
