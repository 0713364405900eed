"""`torc problems`: problems to play, those that come with torc and new ones."""

import shlex
from dataclasses import dataclass
from typing import Annotated

import tyro

from torc.cli.commands import Group
from torc.cli.printing import print_json
from torc.cli.problems_gallery import GalleryCommand
from torc.cli.problems_generate import GenerateCommand
from torc.cli.problems_import import ImportCommand
from torc.cli.problems_solve import SolveCommand
from torc.cli.problems_validate import ValidateCommand


@dataclass(frozen=True)
class ListCommand:
    """List the shipped problems, or those of one set or directory."""

    set: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[SET]")] = ""
    """A shipped set (torc40, validation), a directory of problem files, or several with commas between; all shipped
    ones if not given."""
    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print each selection with a line per problem."""
        from torc.problems.problem import load_problem
        from torc.problems.sets import problem_sets, select_problems

        selections = (self.set,) if self.set else problem_sets()
        groups = {text: [load_problem(name) for name in select_problems(text)] for text in selections}
        if self.json:
            rows = [(p.name, p.category, len(p.objects), p.description) for ps in groups.values() for p in ps]
            print_json([dict(zip(("name", "category", "objects", "description"), row)) for row in rows])
            return 0
        for text, problems in groups.items():
            print(f"{text}: {len(problems)} problem{'s' if len(problems) > 1 else ''}")
            for p in problems:
                print(
                    f"  {p.name:<18} {p.category:<13} {len(p.objects):>2} objects   target: {p.description}"
                )
        return 0


@dataclass(frozen=True)
class ShowCommand:
    """Show one problem: its objects, its target, and how to play it."""

    problem: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="PROBLEM")]
    """Name of a shipped problem (`torc problems list`) or a problem file."""
    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print the problem."""
        from torc.problems.made_for import robot_wanted
        from torc.problems.problem import load_problem
        from torc.records.serialization import to_plain

        problem = load_problem(self.problem)
        if self.json:
            print_json(to_plain(problem))
            return 0
        print(f"{problem.name} ({problem.category}), target: {problem.description} [{problem.target}]\n")
        for k, placement in enumerate(problem.ordered()):
            x, y, z = placement.position
            print(f"  {k:>2}  {placement.name:<28} {placement.model:<28} at {x:.3f} {y:.3f} {z:.3f}")
        robot = robot_wanted(problem)
        if robot:
            print(f"\nMade for the robot '{robot}': its file goes with --robot.")
        print(f"\nPlay it: torc run {shlex.quote(self.problem)}{' --robot FILE' if robot else ''}")
        return 0


PROBLEMS = Group(
    "Problems to play: those that come with torc, new ones from a seed, and those of GraspClutter6D.",
    {
        "list": ("what there is", ListCommand),
        "show": ("one problem: its objects and its target", ShowCommand),
        "gallery": ("pictures of problems, as pages", GalleryCommand),
        "generate": ("make new ones from a seed", GenerateCommand),
        "validate": ("do they hold up, and why not", ValidateCommand),
        "import": ("scenes of GraspClutter6D as problems", ImportCommand),
        "solve": ("the fewest picks that any planner could do with", SolveCommand),
    },
    "Try:\n"
    "  torc problems show structured-03\n"
    "  torc problems generate --count 10 --out mine\n"
    "  torc problems validate mine\n"
    "  torc problems gallery mine --out gallery",
)
