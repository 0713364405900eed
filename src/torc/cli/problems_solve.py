"""`torc problems solve`: the best order of picks for a problem."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from torc.cli.printing import print_json, tell
from torc.episode.oracle.tree import DEFAULT_BUDGET
from torc.specs.conditions import Conditions


@dataclass(frozen=True)
class SolveCommand:
    """Find the order of picks that retrieves the target with the fewest picks, then the fewest drops.

    It tries orders out in simulation, knowing all of it: the upper bound of what any task planner can do in that
    problem with that seed. The answer gets better with the budget, and says whether it is proved to be the best.

    Exit code 0 when an order was found, 1 when none was, 2 on bad arguments.
    """

    problem: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="PROBLEM")]
    """Name of a shipped problem (`torc problems list`) or a problem file."""
    seed: int = 0
    """Seed of the trial: `torc run PROBLEM --planner oracle` with the same seed goes as foreseen here."""
    budget: float = DEFAULT_BUDGET
    """How much to try, in simulated picks; a look counts as half of one. 80 take about a minute at most."""
    conditions: Conditions = field(default_factory=Conditions)
    json: Annotated[bool, tyro.conf.arg(help="Print the answer as JSON; progress goes to stderr.")] = False

    def run(self) -> int:
        """Print the answer."""
        from torc.episode.oracle.solve import solve_problem
        from torc.pipeline.building import build_system
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.made_for import robot_hint
        from torc.problems.problem import load_problem

        problem, system = load_problem(self.problem), build_system(self.conditions)
        if hint := robot_hint(problem, system.robot.name, system.robot.source):
            tell(hint)
        with announced_compilation(tell):
            answer = solve_problem(problem, system, self.seed, self.budget, say=tell)
        if self.json:
            print_json(answer.to_dict())
        else:
            print(answer.text())
        return 0 if answer.solved else 1
