"""`torc problems validate`: is this problem one?"""

import sys
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from torc.cli.printing import print_json, printable, tell
from torc.episode.oracle.tree import DEFAULT_BUDGET
from torc.errors import InputError
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import DEFAULT_WORKSPACE

if TYPE_CHECKING:
    from torc.generation.validation import ValidationReport


@dataclass(frozen=True)
class ValidateCommand:
    """Check problems: do they stay at rest, is the target hard to get, can it be got at all.

    Each problem is left to itself for 10 simulated seconds, in which nothing may move by more than 2 mm or 2 degrees;
    the visible share of the target is measured again; the target must not be graspable at first, but must be with
    nothing in the way, as must every object in front of it, within 15 cm to its left and right, or taller than it
    nearby. Then the oracle (`torc problems solve`) must find an order of at least two picks that retrieves it.

    Try:
      torc problems validate mine/structured-s0000.yaml
      torc problems validate mine --json          # every problem file in there
      torc problems validate torc40 --no-oracle   # a set, some seconds a problem

    Exit code 0 when all are valid, 1 when one is not, 2 on bad input.
    """

    problems: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="PROBLEM...")]
    """Problem files, directories of them, names of shipped problems or sets."""
    no_oracle: bool = False
    """Leave out whether the oracle can solve it: then a problem takes seconds instead of half a minute."""
    budget: float = DEFAULT_BUDGET
    """How much the oracle may try, in simulated picks."""
    seed: int = 0
    """Seed of the oracle's trial."""
    robot: str = DEFAULT_ROBOT
    """Robot: sda10f_2f85, or a robot description file of your own (docs/robots.md)."""
    workspace: str = DEFAULT_WORKSPACE
    """Table, bin and camera: paper, or a workspace file of your own (docs/workspaces.md)."""
    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Check and print; returns the exit code."""
        from torc.generation.batch import inspector_for
        from torc.generation.validation import Check, ValidationReport, oracle_check, validate_problem
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.made_for import robot_hint
        from torc.problems.problem import load_problem
        from torc.problems.sets import select_problems

        if not self.problems:
            raise InputError("Name at least one problem, e.g. `torc problems validate structured-01`.")
        inspector = inspector_for(self.robot, self.workspace)
        resolve = None if self.no_oracle else oracle_check(inspector, self.seed, self.budget, tell)
        names = [name for given in self.problems for name in select_problems(given)]
        problems = {name: load_problem(name) for name in dict.fromkeys(names)}
        reports: dict[str, ValidationReport] = {}
        say = partial(print, file=sys.stderr if self.json else sys.stdout, flush=True)

        def progress(check: Check) -> None:
            say(printable(f"  {'ok ' if check.passed else 'BAD'} {check.name + ':':<14}{check.text}"))

        with announced_compilation(tell):
            for name, problem in problems.items():
                say(f"{name}: {problem.description}")
                if hint := robot_hint(problem, inspector.robot.name, inspector.robot.source):
                    say(f"  {hint}")
                report = validate_problem(problem, inspector, resolve=resolve, progress=progress)
                reports[name] = report
                say(f"  => {'valid' if report.valid else 'NOT VALID'}\n")
        valid = sum(report.valid for report in reports.values())
        if self.json:
            print_json([_facts(name, report) for name, report in reports.items()])
        elif len(reports) > 1:
            print(f"{valid} of {len(reports)} are valid")
        return 0 if valid == len(reports) else 1


def _facts(name: str, report: "ValidationReport") -> dict[str, Any]:
    difficulty = report.difficulty
    return {
        "problem": name,
        "valid": report.valid,
        "checks": [{"name": c.name, "passed": c.passed, "text": c.text} for c in report.checks],
        "difficulty": None if difficulty is None else {"objects": difficulty.objects, **difficulty.facts()},
    }
