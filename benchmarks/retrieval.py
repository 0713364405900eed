"""Retrieval on the shipped problems: success, drops, picks, grasps that hold, failures by cause, time by stage.

    python benchmarks/retrieval.py --out runs/retrieval --seeds 10 --workers 2
    python benchmarks/retrieval.py --out runs/torc40 --planners random dg-select oracle --per-problem

Trials already in --out are not run again, so that a stopped run goes on where it was. The tables are printed and
written to --out/table.md. 95 % intervals are bootstraps over the problems (trials of one problem are not independent).
"""

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import tyro

from intervals import GRASPS_HELD, RETRIEVED, UNSEEN_HELD, WITH_NO_DROP, interval, mean, median
from processes import run_jobs


@dataclass(frozen=True)
class Args:
    """Play every shipped problem with every planner and seed, then print the table."""

    out: Path = Path("runs/retrieval")
    """Directory of the trials."""
    planners: tuple[str, ...] = ("dg-select", "random")
    """Task planners."""
    problems: str = "torc40"
    """A set, problems or a directory of them, with commas between."""
    seeds: int = 10
    """Seeds 0..N-1."""
    workers: int = 2
    """Processes."""
    table_only: bool = False
    """Only print the tables of the trials that are there."""
    per_problem: bool = False
    """Also print how hard the problems are, and a row per problem."""


def play(problem: str, planner: str, seed: int, out: Path, vlm: str | None = None) -> str:
    """Run one trial, with a planner that asks this VLM if one is named; returns a line that says how it went."""
    from torc.episode.trial import TrialSpec, run_trial
    from torc.vlm.config import VlmConfig, parse_vlm

    config = None if vlm is None else VlmConfig(*parse_vlm(vlm))
    trial = run_trial(TrialSpec(problem, planner, seed, vlm=config), out, say=lambda text: None)
    result = trial.result
    if result["status"] != "completed":
        return f"{out.name}: {result['status']}: {result.get('error', '')}"
    verdict = "retrieved" if result["retrieved"] else result["end"]
    return f"{out.name}: {verdict}, {result['picks']} picks, {result['drops']} drops"


def trials(args: Args) -> Iterable[tuple[str, str, int, Path]]:
    """All trials that the arguments ask for."""
    from torc.scenes.problem_sets import select_problems

    for seed in range(args.seeds):
        for problem in select_problems(args.problems):
            for planner in args.planners:
                yield problem, planner, seed, args.out / f"{Path(problem).stem}-{planner}-{seed}"


def run_missing(args: Args) -> None:
    """Run what is not there yet, over several processes."""
    todo = [t for t in trials(args) if not (t[3] / "result.json").exists()]
    args.out.mkdir(parents=True, exist_ok=True)
    run_jobs(play, todo, args.workers)


def load(args: Args) -> list[dict]:
    """Results of all trials that are there, with problem, category, planner and seed."""
    rows = []
    for problem, planner, seed, path in trials(args):
        if (path / "result.json").exists():
            result = json.loads((path / "result.json").read_text())
            events = [json.loads(line) for line in (path / "events.jsonl").read_text().splitlines()]
            facts = {
                "problem": problem,
                "planner": planner,
                "seed": seed,
                "category": loaded(problem).category,
            }
            rows.append({**facts, **result, **unseen_kinds(problem, events), "events": events})
    return rows


@cache
def loaded(problem: str):
    """A problem, read once however many trials it has."""
    from torc.scenes.problem import load_problem

    return load_problem(problem)


def unseen_kinds(problem: str, events: list[dict]) -> dict[str, int]:
    """Executed and held grasps of objects of kinds that the grasp model was never trained on."""
    from torc.records import PickResult
    from torc.scenes.library import load_object

    unseen = [load_object(placement.model).held_out for placement in loaded(problem).ordered()]
    ends = [e for e in events if e["event"] == "executed" and PickResult(e["result"]).grasp_tried]
    tried = [e for e in ends if unseen[e["object_id"]]]
    return {"unseen_executed": len(tried), "unseen_held": sum(e["held_after_lift"] for e in tried)}


def summary(rows: list[dict], planners: tuple[str, ...]) -> str:
    """The table: a row per planner and category."""
    lines = [
        "| planner | scenes | trials | errored | retrieved | with no drop | median picks | mean picks | mean drops "
        "| grasps held | of unseen kinds |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for planner in planners:
        for category in ("all", "structured", "unstructured"):
            mine = [r for r in rows if r["planner"] == planner and category in ("all", r["category"])]
            done = [r for r in mine if r["status"] == "completed"]
            if not done:
                continue
            lines.append(
                f"| {planner} | {category} | {len(mine)} | {len(mine) - len(done)} "
                f"| {interval(done, RETRIEVED)} | {interval(done, WITH_NO_DROP)} "
                f"| {interval(done, median('picks'), digits=1)} | {interval(done, mean('picks'), digits=1)} "
                f"| {interval(done, mean('drops'))} "
                f"| {interval(done, GRASPS_HELD)} | {interval(done, UNSEEN_HELD)} |"
            )
    return "\n".join(lines)


def causes(rows: list[dict], planners: tuple[str, ...]) -> str:
    """How attempts ended, and how episodes ended, by planner."""
    lines = ["| planner | attempts by result | episodes by end |", "|---|---|---|"]
    for planner in planners:
        done = [r for r in rows if r["planner"] == planner and r["status"] == "completed"]
        attempts = Counter(o for r in done for o in r["outcomes"])
        ends = Counter(r["end"] for r in done)
        text = [", ".join(f"{name} {n}" for name, n in counter.most_common()) for counter in (attempts, ends)]
        lines.append(f"| {planner} | {text[0]} | {text[1]} |")
    return "\n".join(lines)


def times(rows: list[dict]) -> str:
    """Wall seconds by step, over all picks and planners."""
    events = [e for r in rows for e in r["events"]]
    look = [sum(e["seconds"].values()) for e in events if e["event"] == "looked"]
    decide = [e["seconds"] for e in events if e["event"] == "decided"]
    plan = [e["seconds"] for e in events if e["event"] == "planned"]
    execute = [e["seconds"] for e in events if e["event"] == "executed" and e["seconds"] > 0]
    episode = [sum(r["seconds"].values()) for r in rows if r["status"] == "completed"]
    lines = ["| step | median, s | p95, s |", "|---|---|---|"]
    named = {
        "image to grasps": look,
        "decision": decide,
        "motion plans of a pick": plan,
        "simulated pick": execute,
        "episode": episode,
    }
    for name, values in named.items():
        if values:
            lines.append(f"| {name} | {np.median(values):.3f} | {np.percentile(values, 95):.3f} |")
    return "\n".join(lines)


def per_problem(rows: list[dict], args: Args) -> list[str]:
    """The tables of the problems: by category, and a row for each."""
    from problem_table import difficulties, facts_table, problem_table
    from torc.scenes.problem_sets import select_problems

    problems = {name: loaded(name) for name in select_problems(args.problems)}
    facts = difficulties(problems)
    return [facts_table(problems, facts), problem_table(rows, args.planners, problems, facts)]


def main() -> None:
    """Run, print and write the tables."""
    args = tyro.cli(Args)
    if not args.table_only:
        run_missing(args)
    rows = load(args)
    tables = [summary(rows, args.planners), causes(rows, args.planners), times(rows)]
    text = "\n\n".join([*tables, *(per_problem(rows, args) if args.per_problem else [])])
    print(text)
    (args.out / "table.md").write_text(text + "\n")


if __name__ == "__main__":
    main()
