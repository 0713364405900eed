"""ORACLE's search: how many picks it needs, what is proved, and what it takes to get there.

    python -m benchmarks.oracle --out runs/oracle --seeds 3 --workers 2

CPU seconds are of one process. Answers already in --out are not sought again, but for those that found no order within
a smaller budget. The table is printed and written to
--out/table.md; the answers are what `torc problems gallery --answers` reads. How ORACLE compares with other planners:
`torc bench --planners oracle,dg-select,random`.
"""

import json
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from benchmarks.processes import run_jobs
from torc.robots.names import DEFAULT_ROBOT


@dataclass(frozen=True)
class Args:
    """Solve problems with several seeds, then print the table."""

    out: Path = Path("runs/oracle")
    """Directory of the answers."""
    problems: str = "torc40"
    """A set, problems or a directory of them, with commas between."""
    seeds: int = 3
    """Seeds 0..N-1."""
    budget: float = 80.0
    """Of each search, in simulated picks."""
    robot: str = DEFAULT_ROBOT
    """Robot that the problems are for."""
    likely: bool = False
    """End with an order that is likely the best, as the planner does, unless the budget allows for the proof."""
    workers: int = 2
    """Processes."""


def solve(problem_name: str, seed: int, budget: float, likely: bool, robot: str = DEFAULT_ROBOT) -> dict:
    """The answer, and when it came."""
    from torc.episode.privileged import open_sandbox
    from torc.episode.steps import EpisodeConfig
    from torc.oracle.answer import answer_from
    from torc.oracle.search import search
    from torc.oracle.solve import Branches
    from torc.pipeline.building import build_system
    from torc.problems.problem import load_problem
    from torc.specs.conditions import Conditions

    problem = load_problem(problem_name)
    system = build_system(Conditions(robot=robot).at(problem.workspace))
    config = EpisodeConfig(seed=seed)
    start, first = time.process_time(), []

    def tell(found) -> None:
        if found.best is not None and not first:
            first.append(time.process_time() - start)

    with open_sandbox(problem, system, config) as sandbox:
        found = search(
            Branches(sandbox),
            sandbox.begin(),
            # Giving up is no pick.
            max_picks=config.max_picks + sandbox.absent,
            budget=budget,
            likely_suffices=likely,
            tell=tell,
        )
    answer = answer_from(found, problem, seed, budget)
    times = {"first_s": first[0] if first else None, "all_s": time.process_time() - start}
    return {**answer.to_dict(), **times, "objects": len(problem.objects), "category": problem.category}


def solve_into(path: Path, problem_name: str, seed: int, budget: float, likely: bool, robot: str) -> str:
    """Keep the answer, complete or not at all; returns a line that says what it is."""
    row = solve(problem_name, seed, budget, likely, robot)
    aside = path.with_suffix(".partial")
    aside.write_text(json.dumps(row))
    aside.replace(path)
    verdict = f"{row['picks']} picks, {row['bound']}"
    return f"{path.stem}: {verdict if row['solved'] else 'no order found'}, {row['all_s']:.0f} s"


def answers(args: Args) -> Iterable[tuple[Path, str, int, float, bool, str]]:
    """Where each answer goes, and what is asked."""
    from torc.problems.sets import select_problems

    for seed in range(args.seeds):
        for problem in select_problems(args.problems):
            path = args.out / f"{Path(problem).stem}-{seed}.json"
            yield path, problem, seed, args.budget, args.likely, args.robot


def is_open(path: Path, budget: float) -> bool:
    """Whether there is no answer yet, or one without an order that a larger budget may find."""
    if not path.exists():
        return True
    answer = json.loads(path.read_text())
    return not answer["solved"] and answer["budget"] < budget


def table(rows: list[dict]) -> str:
    """A row per problem and seed, and what they have in common."""
    lines = [
        "| problem | objects | seed | picks | drops | bound | needed at least | picks tried | looks | "
        "first answer, CPU s | all, CPU s |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        picks = r["picks"] if r["solved"] else "none found"
        first = "" if r["first_s"] is None else f"{r['first_s']:.1f}"
        lines.append(
            f"| {r['problem']} | {r['objects']} | {r['seed']} | {picks} | {r['drops']} "
            f"| {r['bound']} | {r['lower_bound']} | {r['picks_tried']} "
            f"| {r['looks']} | {first} | {r['all_s']:.1f} |"
        )
    solved = [r for r in rows if r["solved"]]
    marks = Counter(r["bound"] for r in rows)
    lines += [
        "",
        f"Solved {len(solved)} of {len(rows)}; {', '.join(f'{n} {mark}' for mark, n in sorted(marks.items()))}; picks: "
        f"median {np.median([r['picks'] for r in solved] or [np.nan]):.0f}, mean "
        f"{np.mean([r['picks'] for r in solved] or [np.nan]):.2f}; CPU seconds to the first answer, median "
        f"{np.median([r['first_s'] for r in solved] or [np.nan]):.1f}, in all "
        f"{np.median([r['all_s'] for r in rows]):.1f} (mean {np.mean([r['all_s'] for r in rows]):.1f}, largest "
        f"{max(r['all_s'] for r in rows):.1f}).",
    ]
    return "\n".join(lines)


def main() -> None:
    """Solve, print and write the table."""
    args = tyro.cli(Args)
    args.out.mkdir(parents=True, exist_ok=True)
    run_jobs(solve_into, [job for job in answers(args) if is_open(job[0], args.budget)], args.workers)
    text = table([json.loads(path.read_text()) for path, *_ in sorted(answers(args))])
    print(text)
    (args.out / "table.md").write_text(text + "\n")


if __name__ == "__main__":
    main()
