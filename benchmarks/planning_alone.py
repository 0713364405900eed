"""Planners without luck: each pick takes its object away, and does nothing else.

    python -m benchmarks.planning_alone --problems runs/fresh --planners dg-select,belief,belief:search.depth=1

In whole trials most of the difference between two good planners is luck: a slip, something that rolls. Here every
planner sees the same scene without the objects that it has taken, as the camera, the occlusion volume and the grasp
planner show it, until it takes the target; nothing slips, falls or is dropped. A trial takes seconds, and what is left
is planning. `shortest` knows what hides the target: the fewest objects, the target included, after which it can be
picked. Nobody who must look for it can do that on average; how near one can come, this does not tell.

Picks count 15 where the target was not taken; `tries` are the sum of 1 / p(hold) of the grasps. Differences are to the
first planner, paired by problem; intervals (95 %) are over problems. What was played is kept in --out, one line of JSON
per problem, and not played again.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import tyro

from tools.ideal import looks_of, retrieve, shortest
from torc.benchmark.intervals import by_problem, difference, mean
from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError, TorcError
from torc.oracle.solve import MAX_PICKS
from torc.pipeline.building import build_system
from torc.pipeline.planners import is_reference, make_spec_planner
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.specs.conditions import Conditions, plain_value
from torc.specs.trial import PlannerSpec
from torc.task_planning.protocol import TaskPlanner


@dataclass(frozen=True)
class Args:
    """Planners compared without luck."""

    planners: str = "dg-select,belief"
    """Comma-separated; settings stand behind a name as in belief:search.depth=1+prices.hold=false."""
    problems: str = "torc40"
    """Sets, problems, problem files or directories of them, comma-separated."""
    most_looks: int = 120
    """Looks that the search for the shortest order may take; 0 to leave it out."""
    out: Path | None = None
    """File of what was played; gone on with if it exists."""


def planner_spec(text: str) -> PlannerSpec:
    """From NAME or NAME:setting=value+setting=value. Raises InputError for settings that are none."""
    name, _, rest = text.partition(":") if "=" in text else (text, "", "")
    settings = dict[str, Any]()
    for part in filter(None, rest.split("+")):
        path, equals, value = part.partition("=")
        if not equals:
            raise InputError(f"'{part}' in '{text}' is no setting; write setting=value.")
        settings[path] = plain_value(value)
    if is_reference(name):
        raise InputError(f"{name} tries picks out in a simulation of its own; here are none.")
    return PlannerSpec(name, settings=settings)


def play(problem_file: str, planners: dict[str, TaskPlanner], most_looks: int) -> dict[str, Any]:
    """One problem: what each planner took, how long the shortest order is, and whether the target is in sight."""
    system = build_system(Conditions())
    with open_sandbox(load_problem(problem_file), system, EpisodeConfig(MAX_PICKS, 0)) as sandbox:
        look = looks_of(sandbox)
        row: dict[str, Any] = {"hidden": look(()).scene.target_id is None}
        for label, planner in planners.items():
            found = retrieve(planner, look)
            row[label] = {"picks": found.picks, **asdict(found)}
        if most_looks:
            row["shortest"] = shortest(look, most_looks)
    return row


def table(rows: dict[str, dict[str, Any]], labels: list[str]) -> str:
    """Planners by whether the target is out of sight at first."""
    lines = [
        "| target at first | planner | n | taken | picks | tries | picks more than the first | better / worse |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for hidden in (True, False):
        names = [n for n, r in rows.items() if r["hidden"] == hidden and all(k in r for k in labels)]
        if not names:
            continue
        where = "out of sight" if hidden else "in sight"
        known = [n for n in names if rows[n].get("shortest")]
        if known:
            cells = _mean(known, [rows[n]["shortest"] for n in known])
            lines.append(f"| {where} | shortest | {len(known)} | | {cells} | | | |")
        for label in labels:
            own = [rows[n][label] for n in names]
            more = [r["picks"] - rows[n][labels[0]]["picks"] for n, r in zip(names, own)]
            # One that did not get there has tries for what it took alone.
            tries = [min(r["tries"], 2 * MAX_PICKS) if r["taken"] else 2 * MAX_PICKS for r in own]
            cells = f"{sum(r['taken'] for r in own)} | {_mean(names, [r['picks'] for r in own])}"
            against = (
                "" if label == labels[0] else difference(*by_problem(names, more, [1.0] * len(names))).text()
            )
            counts = "" if label == labels[0] else f"{sum(d < 0 for d in more)} / {sum(d > 0 for d in more)}"
            lines.append(
                f"| {where} | {label} | {len(names)} | {cells} | {_mean(names, tries)} | {against} | {counts} |"
            )
    return "\n".join(lines)


def _mean(names: list[str], values: list[float]) -> str:
    ones = [1.0] * len(names)
    return mean(*by_problem(names, values, ones)).text()


def main() -> None:
    """Play what is missing, and print the table."""
    args = tyro.cli(Args)
    specs = {s.label: s for s in map(planner_spec, args.planners.split(","))}
    rows: dict[str, dict[str, Any]] = {}
    if args.out is not None and args.out.exists():
        rows = {r["problem"]: r for r in map(json.loads, args.out.read_text().splitlines())}
    for problem_file in select_problems(args.problems):
        name = Path(problem_file).stem
        missing = [k for k in specs if k not in rows.get(name, {})]
        if not missing:
            continue
        planners = {k: make_spec_planner(specs[k], None, None) for k in missing}
        try:
            played = play(problem_file, planners, 0 if "shortest" in rows.get(name, {}) else args.most_looks)
        except TorcError as error:
            print(f"{name}: {error}", flush=True)
            continue
        rows[name] = {"problem": name, **rows.get(name, {}), **played}
        told = ", ".join(f"{k} {played[k]['picks']}" for k in missing)
        print(f"{name}: {told}, shortest {rows[name].get('shortest')}", flush=True)
        if args.out is not None:
            args.out.write_text("".join(json.dumps(r) + "\n" for r in rows.values()))
    print("\n" + table(rows, list(specs)))


if __name__ == "__main__":
    main()
