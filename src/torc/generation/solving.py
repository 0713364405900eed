"""Solving a problem again, as a check: the stand-in for the paper's people who tried each problem.

"The scene was adjusted [...] until it admitted a solution with a task sequence of at least two steps." (Simulated
Dataset, step 5)
"""

from collections.abc import Callable

from torc.episode.oracle.budget import DEFAULT_BUDGET, check_budget
from torc.episode.oracle.solve import solve_problem
from torc.errors import InputError, PhysicsError
from torc.generation.inspection import Inspector
from torc.generation.validation import Check, Resolve
from torc.problems.problem import Problem

FEWEST_PICKS = 2


def oracle_check(
    inspector: Inspector,
    seed: int = 0,
    budget: float = DEFAULT_BUDGET,
    say: Callable[[str], None] = lambda text: None,
) -> Resolve:
    """A check that the oracle finds an order of picks, of at least two, that retrieves the target.

    Args:
        inspector: the robot and its workspace.
        seed: of the trial.
        budget: how much the oracle may try, in simulated picks.
        say: told about progress.

    Raises:
        InputError: the budget is no positive number.
    """
    check_budget(budget)

    def resolve(problem: Problem) -> Check:
        try:
            answer = solve_problem(problem, inspector.system, seed, budget, say=say)
        except (InputError, PhysicsError) as error:
            return Check("solution", False, f"It cannot be played: {error}")
        text = answer.verdict()
        if answer.solved:
            text = f"{text} The order: {', '.join(answer.order)}."
        return Check("solution", answer.solved and answer.picks >= FEWEST_PICKS, text)

    return resolve
