"""`torc problems`: problems to play, those that come with torc and new ones."""

import shlex
from dataclasses import asdict, dataclass
from typing import Annotated

import tyro

from torc.cli.commands import Group
from torc.cli.options import JsonOption
from torc.cli.printing import print_json
from torc.problems.sets import problem_sets, select_problems
from torc.problems.summaries import problem_summary


@dataclass(frozen=True)
class ListCommand:
    """List the shipped problems, or those of one set or directory."""

    set: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[SET]")] = ""
    """A shipped set (torc40, validation, validation-ur5e, validation-panda), a directory of problem files, or several
    with commas between; all shipped ones if not given."""
    json: JsonOption = False

    def run(self) -> int:
        selections = (self.set,) if self.set else problem_sets()
        groups = {text: [problem_summary(name) for name in select_problems(text)] for text in selections}
        if self.json:
            print_json([asdict(p) for problems in groups.values() for p in problems])
            return 0
        for text, problems in groups.items():
            print(f"{text}: {len(problems)} problem{'s' if len(problems) > 1 else ''}")
            for p in problems:
                print(f"  {p.name:<18} {p.category:<13} {p.objects:>2} objects   target: {p.description}")
        return 0


@dataclass(frozen=True)
class ShowCommand:
    """Show one problem: its objects, its target, and how to play it."""

    problem: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="PROBLEM")]
    """Name of a shipped problem (`torc problems list`) or a problem file."""
    json: JsonOption = False

    def run(self) -> int:
        from torc.io.record_files import to_plain
        from torc.problems.problem import load_problem, robot_option, robot_wanted

        problem = load_problem(self.problem)
        if self.json:
            print_json(to_plain(problem))
            return 0
        print(f"{problem.name} ({problem.category}), target: {problem.description} [{problem.target}]\n")
        for k, placement in enumerate(problem.ordered()):
            x, y, z = placement.position
            where = f"at {x:.3f} {y:.3f} {z:.3f}"
            if problem.absent and placement.name == problem.target:
                where = "is not there"
            print(f"  {k:>2}  {placement.name:<28} {placement.model:<28} {where}")
        option = robot_option(problem)
        if option == "FILE":
            print(f"\nMade for the robot '{robot_wanted(problem)}': its file goes with --robot.")
        print(f"\nPlay it: torc run {shlex.quote(self.problem)}{f' --robot {option}' if option else ''}")
        return 0


PROBLEMS = Group(
    "Problems to play: those that come with torc, new ones from a seed, and those of GraspClutter6D.",
    {
        "list": ("what there is", ListCommand),
        "show": ("one problem: its objects and its target", ShowCommand),
        "gallery": ("pictures of problems, as pages", "torc.cli.problems_check:GalleryCommand"),
        "generate": ("make new ones from a seed", "torc.cli.problems_generate:GenerateCommand"),
        "validate": ("do they hold up, and why not", "torc.cli.problems_check:ValidateCommand"),
        "import": ("scenes of GraspClutter6D as problems", "torc.cli.problems_import:ImportCommand"),
        "solve": ("the fewest picks that any planner could do with", "torc.cli.problems_check:SolveCommand"),
    },
    "Try:\n"
    "  torc problems show structured-03\n"
    "  torc problems generate --count 10 --out mine\n"
    "  torc problems validate mine\n"
    "  torc problems gallery mine --out gallery",
)
