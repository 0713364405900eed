"""`torc problems solve`: the best order of picks for a problem."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from torc.episode.oracle.budget import DEFAULT_BUDGET
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
        import json
        import sys

        from torc.episode.oracle.solve import solve_problem
        from torc.errors import InputError
        from torc.pipeline.building import build_system
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.made_for import robot_hint
        from torc.problems.problem import load_problem

        if self.seed < 0:
            raise InputError("--seed must be at least 0.")

        def say(text: str) -> None:
            print(text, file=sys.stderr, flush=True)

        problem, system = load_problem(self.problem), build_system(self.conditions)
        if hint := robot_hint(problem, system.robot.name, system.robot.source):
            say(hint)
        with announced_compilation(say):
            answer = solve_problem(problem, system, self.seed, self.budget, say=say)
        print(json.dumps(answer.to_dict(), indent=2) if self.json else answer.text())
        return 0 if answer.solved else 1
