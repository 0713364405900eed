"""Retrieval on the shipped problems: success, drops, picks, grasps that hold, failures by cause, time by stage.

    python benchmarks/retrieval.py --out runs/retrieval --seeds 10 --workers 2

Trials already in --out are not run again, so that a stopped run goes on where it was. The table is printed and written
to --out/table.md. 95 % intervals are bootstraps over the problems (trials of one problem are not independent).
"""

import json
import os
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import tyro


@dataclass(frozen=True)
class Args:
    """Play every shipped problem with every planner and seed, then print the table."""

    out: Path = Path("runs/retrieval")
    """Directory of the trials."""
    planners: tuple[str, ...] = ("dg-select", "random")
    """Task planners."""
    problems: tuple[str, ...] = ()
    """Names of problems; all shipped ones if empty."""
    seeds: int = 10
    """Seeds 0..N-1."""
    workers: int = 2
    """Processes."""
    table_only: bool = False
    """Only print the table of the trials that are there."""


def play(problem: str, planner: str, seed: int, out: Path) -> str:
    """Run one trial unless it is there; returns a line that says how it went."""
    from torc.episode.trial import TrialSpec, run_trial

    trial = run_trial(TrialSpec(problem, planner, seed), out, say=lambda text: None)
    result = trial.result
    if result["status"] != "completed":
        return f"{out.name}: {result['status']}: {result.get('error', '')}"
    verdict = "retrieved" if result["retrieved"] else result["end"]
    return f"{out.name}: {verdict}, {result['picks']} picks, {result['drops']} drops"


def trials(args: Args) -> Iterable[tuple[str, str, int, Path]]:
    """All trials that the arguments ask for."""
    from torc.scenes.problem import problem_names

    for seed in range(args.seeds):
        for problem in args.problems or problem_names():
            for planner in args.planners:
                yield problem, planner, seed, args.out / f"{problem}-{planner}-{seed}"


def run_missing(args: Args) -> None:
    """Run what is not there yet, over several processes."""
    todo = [t for t in trials(args) if not (t[3] / "result.json").exists()]
    args.out.mkdir(parents=True, exist_ok=True)
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NUMBA_NUM_THREADS="1")
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        futures = [pool.submit(play, *t) for t in todo]
        for i, future in enumerate(as_completed(futures)):
            print(f"[{i + 1}/{len(todo)}] {future.result()}", flush=True)


def load(args: Args) -> list[dict]:
    """Results of all trials that are there, with problem, category, planner and seed."""
    from torc.scenes.problem import load_problem

    rows = []
    for problem, planner, seed, path in trials(args):
        if (path / "result.json").exists():
            result = json.loads((path / "result.json").read_text())
            events = [json.loads(line) for line in (path / "events.jsonl").read_text().splitlines()]
            facts = {
                "problem": problem,
                "planner": planner,
                "seed": seed,
                "category": load_problem(problem).category,
            }
            rows.append({**facts, **result, **unseen_kinds(problem, events), "events": events})
    return rows


def unseen_kinds(problem: str, events: list[dict]) -> dict[str, int]:
    """Executed and held grasps of objects of kinds that the grasp model was never trained on."""
    from torc.scenes.library import load_object
    from torc.scenes.problem import load_problem

    unseen = [load_object(placement.model).held_out for placement in load_problem(problem).ordered()]
    tried = [e for e in events if e["event"] == "executed" and e["duration_s"] > 0 and unseen[e["object_id"]]]
    return {"unseen_executed": len(tried), "unseen_held": sum(e["held_after_lift"] for e in tried)}


def interval(rows: list[dict], statistic: Callable[[list[dict]], float], draws: int = 2000) -> str:
    """A statistic with its 95 % interval: bootstrap over problems."""
    groups: dict[str, list[dict]] = {}
    for row in rows:
        groups.setdefault(row["problem"], []).append(row)
    names, rng = sorted(groups), np.random.default_rng(0)
    values = []
    for _ in range(draws):
        sample = [row for i in rng.integers(0, len(names), len(names)) for row in groups[names[i]]]
        values.append(statistic(sample))
    low, high = np.nanpercentile(values, [2.5, 97.5])
    return f"{statistic(rows):.2f} [{low:.2f}, {high:.2f}]"


def share(predicate: Callable[[dict], bool]) -> Callable[[list[dict]], float]:
    """Share of the rows for which the predicate holds."""
    return lambda rows: float(np.mean([predicate(row) for row in rows]))


def rate(held: str, executed: str) -> Callable[[list[dict]], float]:
    """Sum of one column over the sum of another; NaN where the latter is 0."""
    return lambda rows: (
        sum(r[held] for r in rows) / n if (n := sum(r[executed] for r in rows)) else float("nan")
    )


GRASPS_HELD = rate("grasps_held", "grasps_executed")
UNSEEN_HELD = rate("unseen_held", "unseen_executed")


def summary(rows: list[dict], planners: tuple[str, ...]) -> str:
    """The table: a row per planner and category."""
    lines = [
        "| planner | scenes | trials | errored | retrieved | with no drop | median picks | mean drops | grasps held "
        "| of unseen kinds |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for planner in planners:
        for category in ("all", "structured", "unstructured"):
            mine = [r for r in rows if r["planner"] == planner and category in ("all", r["category"])]
            done = [r for r in mine if r["status"] == "completed"]
            if not done:
                continue
            lines.append(
                f"| {planner} | {category} | {len(mine)} | {len(mine) - len(done)} "
                f"| {interval(done, share(lambda r: r['retrieved']))} "
                f"| {interval(done, share(lambda r: r['retrieved'] and r['drops'] == 0))} "
                f"| {np.median([r['picks'] for r in done]):.0f} | {np.mean([r['drops'] for r in done]):.2f} "
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
    episode = [
        r["seconds"].get("look", 0)
        + sum(r["seconds"].get(s, 0) for s in ("decide", "plan motions", "execute"))
        for r in rows
        if r["status"] == "completed"
    ]
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


def main() -> None:
    """Run, print and write the table."""
    args = tyro.cli(Args)
    if not args.table_only:
        run_missing(args)
    rows = load(args)
    text = "\n\n".join([summary(rows, args.planners), causes(rows, args.planners), times(rows)])
    print(text)
    (args.out / "table.md").write_text(text + "\n")


if __name__ == "__main__":
    main()
