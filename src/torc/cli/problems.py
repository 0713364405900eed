"""`torc problems`: the problems that come with torc."""

import json as json_module
from dataclasses import dataclass
from typing import Annotated

import tyro


@dataclass(frozen=True)
class ListCommand:
    """List the shipped problems."""

    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print a line per problem."""
        from torc.scenes.problem import load_problem, problem_names

        problems = [load_problem(name) for name in problem_names()]
        if self.json:
            rows = [
                {
                    "name": p.name,
                    "category": p.category,
                    "objects": len(p.objects),
                    "description": p.description,
                }
                for p in problems
            ]
            print(json_module.dumps(rows, indent=2))
            return 0
        for p in problems:
            print(f"{p.name:<18} {p.category:<13} {len(p.objects):>2} objects   target: {p.description}")
        return 0


@dataclass(frozen=True)
class ShowCommand:
    """Show one problem: its objects, its target, and how to play it."""

    problem: tyro.conf.Positional[str]
    """Name or file."""
    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print the problem."""
        from torc.records.serialization import to_plain
        from torc.scenes.problem import load_problem

        problem = load_problem(self.problem)
        if self.json:
            print(json_module.dumps(to_plain(problem), indent=2))
            return 0
        print(f"{problem.name} ({problem.category}), target: {problem.description} [{problem.target}]\n")
        for k, placement in enumerate(problem.ordered()):
            x, y, z = placement.position
            print(f"  {k:>2}  {placement.name:<28} {placement.model:<28} at {x:.3f} {y:.3f} {z:.3f}")
        print(f"\nPlay it: torc run {self.problem}")
        return 0


@dataclass(frozen=True)
class ProblemsCommand:
    """List and show problems."""

    action: (
        Annotated[ListCommand, tyro.conf.subcommand("list")]
        | Annotated[ShowCommand, tyro.conf.subcommand("show")]
    )

    def run(self) -> int:
        """Run the chosen action."""
        return self.action.run()
