"""`torc problems gallery`: what problems look like."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from torc.cli.printing import print_json, tell
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import DEFAULT_WORKSPACE


@dataclass(frozen=True)
class GalleryCommand:
    """Draw a card per problem, and pages that show them.

    A card has four views (what the robot's camera sees, front, side, top) with the target outlined, solid where it is
    in sight and dashed where something hides it; what is wanted in words; how hard it is; and, where it is known, the
    order of picks that the oracle found, with its numbers in the views. A few seconds a problem.

    In DIR are then
      index.html     cards to filter by category and by how much of the target is
                     in sight; opens without a network
      gallery.md     the same as one long page, for code hosts
      cards/*.jpg    at most 70 kB each

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
    """Directory of the oracle's answers, *.json, as `torc problems solve --json` prints and benchmarks/oracle.py
    writes them. Of answers for several seeds the first counts. Without an answer a card has the order that its
    problem's file states, if any."""
    robot: str = DEFAULT_ROBOT
    """Robot: sda10f_2f85, or a robot description file of your own (docs/robots.md)."""
    workspace: str = DEFAULT_WORKSPACE
    """Table, bin and camera: paper, or a workspace file of your own (docs/workspaces.md)."""
    title: str = ""
    """Heading of the pages; made of SELECTION if not given."""
    json: Annotated[bool, tyro.conf.arg(help="Print what the cards say as JSON.")] = False

    def run(self) -> int:
        """Draw and write."""
        from torc.generation.batch import inspector_for
        from torc.generation.gallery import HTML, MARKDOWN, left_over, make_gallery
        from torc.generation.oracle_orders import orders_from
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.problem import Problem, load_problem
        from torc.problems.sets import select_problems

        problems = [load_problem(name) for name in select_problems(self.problems)]
        orders = orders_from(self.answers, problems) if self.answers else {}
        title = self.title or f"{self.problems}: {len(problems)} problem{'s' if len(problems) > 1 else ''}"
        inspector, names = inspector_for(self.robot, self.workspace), [problem.name for problem in problems]

        def progress(problem: Problem) -> None:
            tell(f"{names.index(problem.name) + 1} of {len(names)}: {problem.name}")

        with announced_compilation(tell):
            cards = make_gallery(title, problems, inspector, self.out, orders, progress)
        for name in left_over(problems, self.out):
            tell(f"Of an earlier gallery, and on no page now: {self.out / 'cards' / name}")
        if self.json:
            print_json([card.to_dict() for card in cards])
        else:
            print(f"{len(cards)} cards. Open {self.out / HTML}, or read {self.out / MARKDOWN}.")
        return 0
