"""`torc problems validate`, `gallery` and `solve`: check problems, draw them, and find the best order of picks."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from torc.cli.options import JsonOption, RobotOption, WorkspaceOption
from torc.cli.printing import print_json, tell, teller
from torc.errors import InputError
from torc.oracle.tree import DEFAULT_BUDGET
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import DEFAULT_WORKSPACE, Conditions


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
    robot: RobotOption = DEFAULT_ROBOT
    workspace: WorkspaceOption = DEFAULT_WORKSPACE
    json: JsonOption = False

    def run(self) -> int:
        from torc.generation.generator import inspector_for
        from torc.generation.validation import Check, ValidationReport, oracle_check, validate_problem
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.problem import load_problem, robot_hint
        from torc.problems.sets import select_problems

        if not self.problems:
            raise InputError("Name at least one problem, e.g. `torc problems validate structured-01`.")
        conditions = Conditions(robot=self.robot, workspace=self.workspace)
        names = [name for given in self.problems for name in select_problems(given)]
        problems = {name: load_problem(name) for name in dict.fromkeys(names)}
        reports: dict[str, ValidationReport] = {}
        say = teller(self.json)

        def progress(check: Check) -> None:
            say(f"  {'ok ' if check.passed else 'BAD'} {check.name + ':':<14}{check.text}")

        with announced_compilation(tell):
            for name, problem in problems.items():
                say(f"{name}: {problem.description}")
                inspector = inspector_for(self.robot, conditions.at(problem.workspace).workspace)
                resolve = None if self.no_oracle else oracle_check(inspector, self.seed, self.budget, tell)
                if hint := robot_hint(problem, inspector.robot.name, inspector.robot.source):
                    say(f"  {hint}")
                report = validate_problem(problem, inspector, resolve=resolve, progress=progress)
                reports[name] = report
                say(f"  => {'valid' if report.valid else 'NOT VALID'}\n")
        valid = sum(report.valid for report in reports.values())
        if self.json:
            rows: list[dict[str, Any]] = []
            for name, report in reports.items():
                found = report.difficulty
                difficulty = None if found is None else {"objects": found.objects, **found.facts()}
                checks = [check._asdict() for check in report.checks]
                facts = {"problem": name, "valid": report.valid}
                rows.append({**facts, "checks": checks, "difficulty": difficulty})
            print_json(rows)
        elif len(reports) > 1:
            print(f"{valid} of {len(reports)} are valid")
        return 0 if valid == len(reports) else 1


@dataclass(frozen=True)
class GalleryCommand:
    """Draw a card per problem, and pages that show them.

    A card has four views (what the robot's camera sees, front, side, top) with the target outlined, solid where it is
    in sight and dashed where something hides it; the target in words; the difficulty; and, if it is known, the order of
    picks that the oracle found, with its numbers in the views. A few seconds a problem.

    DIR/index.html has cards to filter, and opens without a network; gallery.md is the same for code hosts.

    Try:
      torc problems gallery --out gallery
      torc problems gallery mine --out mine-gallery          # a directory of files
      torc problems solve structured-04 --json > answers/structured-04.json
      torc problems gallery structured-04 --answers answers  # with oracle's order
    """

    problems: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[SELECTION]")] = "torc40"
    """A shipped set or problem, a problem file, a directory of them, or several of these with commas between."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")] = Path("gallery")
    """Where the pages go; files of the same names are replaced."""
    answers: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory of the oracle's answers, as `torc problems solve --json` prints them; without one a card has the order
    that its problem's file states, if any."""
    robot: RobotOption = DEFAULT_ROBOT
    workspace: WorkspaceOption = DEFAULT_WORKSPACE
    title: str = ""
    """Heading of the pages; made of SELECTION if not given."""
    json: Annotated[bool, tyro.conf.arg(help="Print what the cards say as JSON.")] = False

    def run(self) -> int:
        from torc.generation.gallery import HTML, MARKDOWN, make_gallery
        from torc.generation.generator import inspector_for
        from torc.generation.inspection import Inspector
        from torc.oracle.answer import orders_from
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.problem import Problem, load_problem
        from torc.problems.sets import select_problems

        problems = [load_problem(name) for name in select_problems(self.problems)]
        orders = orders_from(self.answers, problems) if self.answers else {}
        title = self.title or f"{self.problems}: {len(problems)} problem{'s' if len(problems) > 1 else ''}"
        names = [problem.name for problem in problems]
        conditions = Conditions(robot=self.robot, workspace=self.workspace)

        def inspector(problem: Problem) -> Inspector:
            return inspector_for(self.robot, conditions.at(problem.workspace).workspace)

        inspector_for(self.robot, self.workspace)  # unknown names are refused before any work

        def progress(problem: Problem) -> None:
            tell(f"{names.index(problem.name) + 1} of {len(names)}: {problem.name}")

        with announced_compilation(tell):
            cards = make_gallery(title, problems, inspector, self.out, orders, progress)
        if self.json:
            print_json([card.to_dict() for card in cards])
        else:
            print(f"{len(cards)} cards. Open {self.out / HTML}, or read {self.out / MARKDOWN}.")
        return 0


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
        from torc.oracle.solve import solve_problem
        from torc.pipeline.building import build_system
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.problem import load_problem, robot_hint

        problem = load_problem(self.problem)
        system = build_system(self.conditions.at(problem.workspace))
        if hint := robot_hint(problem, system.robot.name, system.robot.source):
            tell(hint)
        with announced_compilation(tell):
            answer = solve_problem(problem, system, self.seed, self.budget, say=tell)
        if self.json:
            print_json(answer.to_dict())
        else:
            print(answer.text())
        return 0 if answer.solved else 1
