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
from torc.motion.planner import OmplMotionPlanner
from torc.pipeline.defaults import default_pipeline
from torc.robots.description import RobotDescription
from torc.scenes.problem import Problem
from torc.scenes.workspace import Workspace


def solve_problem(
    problem: Problem,
    robot: RobotDescription,
    workspace: Workspace,
    seed: int = 0,
    budget: float = DEFAULT_BUDGET,
    *,
    max_picks: int = 15,
    likely_suffices: bool = False,
    say: Callable[[str], None] = lambda text: None,
) -> OracleAnswer:
    """The order of picks that retrieves the target with the fewest picks, then the fewest drops.

    A trial with the same seed that picks in this order goes exactly as foreseen.

    Args:
        problem, robot, workspace: what is simulated.
        seed: of the trial; grasps and motions depend on it.
        budget: how much to try, in simulated picks (a look counts as half of one).
        max_picks: longer orders do not count.
        likely_suffices: end with an order that is likely the best, unless the budget allows for the proof.
        say: told about progress.

    Raises:
        InputError: the budget is no positive number, or the problem cannot be played.
        PhysicsError: the simulation broke before the first pick.
    """
    check_budget(budget)
    config = EpisodeConfig(max_picks, seed)
    pipeline, motion = default_pipeline(robot, workspace), OmplMotionPlanner(robot, workspace)
    with open_sandbox(problem, robot, pipeline, motion, config) as sandbox:
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
