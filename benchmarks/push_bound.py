"""What could a push save at most? The shortest order of picks, against the shortest where whatever is in sight can be
moved out of the way, gripped or not, each for one action.

    python -m benchmarks.push_bound --problems torc-hard/ungraspable,torc40 --out build/push.jsonl

Orders as in `benchmarks.planning_alone`: each pick takes its object away, and nothing slips or falls. A push that does
this to every object that cannot be gripped, never fails, and leaves what it moved nowhere in the way, is better than
any real one. The target itself must still be gripped. A line for each problem, then the mean.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import tyro

from tools.ideal import Look, looks_of
from torc.benchmark.intervals import by_problem, difference
from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import TorcError
from torc.oracle.promise import rough_plans
from torc.oracle.solve import MAX_PICKS, options_of
from torc.oracle.tree import Options
from torc.pipeline.building import build_system
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import TARGET_ID, PlanningContext
from torc.specs.conditions import Conditions


@dataclass(frozen=True)
class Args:
    """How many picks a perfect push could save."""

    problems: str = "torc-hard/ungraspable"
    """Sets, problems, problem files or directories of them, comma-separated."""
    most_looks: int = 120
    """Of each of the two searches."""
    out: Path | None = None
    """A line for each problem; gone on with if it exists."""


def with_pushes(context: PlanningContext) -> Options:
    """What can be picked first, then everything else in sight but the target."""
    options = options_of(context)
    pushed = [k for k in context.scene.ids if k not in options.choices and k != TARGET_ID]
    return replace(options, choices=(*(k for k in options.choices if k is not None), *pushed))


def orders(problem_file: str, most_looks: int) -> tuple[int | None, int | None]:
    """Actions of the shortest order without pushes, and with them; None where the search finds none."""
    system, config = build_system(Conditions()), EpisodeConfig(MAX_PICKS, 0)
    with open_sandbox(load_problem(problem_file), system, config) as sandbox:
        look = looks_of(sandbox)
        return tuple(_shortest(look, options, most_looks) for options in (options_of, with_pushes))


def _shortest(look: Look, options: Callable[[PlanningContext], Options], most_looks: int) -> int | None:
    plans = rough_plans(lambda gone: options(look(gone)), options(look(())))
    return next((picks for (picks, order), _ in zip(plans, range(most_looks)) if order is not None), None)


def main() -> None:
    """Search what is missing, and print what was found."""
    args = tyro.cli(Args)
    lines = args.out.read_text().splitlines() if args.out is not None and args.out.exists() else []
    rows = {row["problem"]: row for row in map(json.loads, lines)}
    names = {Path(file).stem: file for file in select_problems(args.problems)}
    for name, file in names.items():
        if name in rows:
            continue
        try:
            picks, actions = orders(file, args.most_looks)
        except TorcError as error:
            print(f"{name}: {error}", flush=True)
            continue
        rows[name] = {"problem": name, "picks": picks, "with_pushes": actions}
        print(f"{name}: {picks} picks, {actions} with pushes", flush=True)
        if args.out is not None:
            args.out.parent.mkdir(parents=True, exist_ok=True)
            args.out.write_text("".join(json.dumps(row) + "\n" for row in rows.values()))
    both = [rows[n] for n in names if n in rows and None not in (rows[n]["picks"], rows[n]["with_pushes"])]
    gaps = [r["picks"] - r["with_pushes"] for r in both]
    saved = difference(*by_problem([r["problem"] for r in both], gaps, [1] * len(both)))
    alone = sum(r["picks"] is None and r["with_pushes"] is not None for r in rows.values())
    print(
        f"{len(both)} problems: a push saves {saved.text()} actions. Only pushes lead there in {alone} more."
    )


if __name__ == "__main__":
    main()
