"""How much harder than it looks an object is that failed: measures `FailureConfig.log_odds`.

    torc problems generate --count 60 --seed 760000 --out runs/memory_problems
    python -m benchmarks.failure_memory --problems runs/memory_problems --seeds 2 --workers 2

Plays trials without that memory (`--log-odds 0`, the default here), and notes for every grasp that was tried the
probability that it was given, and how often a try with the same object had failed before. The table compares what was
promised with what was delivered. The fit is the number d for which log-odds of p - d x (failures before) are those of
delivery, among the tries after a failure; its 95 % interval takes the problems as the sample. With the memory on the
fit is what is left to correct, about 0. Trials already in --out are not played again.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from jaxtyping import Float
from scipy.optimize import brentq
from scipy.special import expit, logit

from benchmarks.processes import run_jobs

_MOST = 5
"""Rows of the table: this many failures and more are one."""
_FURTHEST = 20.0


@dataclass(frozen=True)
class Args:
    """Gather tries, then fit."""

    problems: str
    """A set, problems or a directory of them, with commas between; not what planners are compared on."""
    out: Path = Path("runs/failure_memory")
    """Directory of the tries."""
    planners: tuple[str, ...] = ("random", "dg-select")
    """Who chooses what to pick."""
    seeds: int = 1
    """Seeds 0..N-1."""
    log_odds: float = 0.0
    """What a failure takes while the trials are played."""
    workers: int = 2
    """Processes."""


def gather(problem_name: str, planner: str, seed: int, log_odds: float, path: Path) -> str:
    """Play a trial and keep its tries, complete or not at all."""
    from torc.episode.events import Event, Executed, Planned, Started
    from torc.episode.loop import run_episode
    from torc.episode.simulated import episode_in, simulated_robot
    from torc.episode.steps import EpisodeConfig
    from torc.pipeline.building import build_system
    from torc.pipeline.failures import failed_tries
    from torc.pipeline.planners import make_planner
    from torc.problems.problem import load_problem
    from torc.records import PickOutcome, PickPlan
    from torc.specs.conditions import Conditions

    problem = load_problem(problem_name)
    system = build_system(Conditions(settings={"failures.log_odds": log_odds}))
    tries: list[dict] = []
    history: tuple[PickOutcome, ...] = ()
    promised = 0.0

    def note(event: Event) -> None:
        nonlocal promised, history
        match event:
            case Planned(plan=PickPlan(grasp_index=g), look=look):
                promised = float(look.context.grasps.scores[g])
            case Executed(outcome=outcome):
                if outcome.result.grasp_tried:
                    before = failed_tries(history)[outcome.object_id]
                    tries.append({"p": promised, "failures": before, "delivered": outcome.as_felt.delivered})
                history = (*history, outcome.as_felt)

    with simulated_robot(system, problem) as simulated:
        simulated.take_over()
        config = EpisodeConfig(seed=seed)
        started = Started(problem.name, planner, seed, problem.description, config.max_picks)
        run_episode(episode_in(simulated, system, config, [note]), make_planner(planner), started)
    aside = path.with_suffix(".partial")
    aside.write_text(json.dumps({"problem": problem.name, "category": problem.category, "tries": tries}))
    aside.rename(path)
    return f"{path.stem}: {len(tries)} tries"


@dataclass(frozen=True)
class Fit:
    """What a failure takes from the log-odds, with its 95 % interval."""

    value: float
    low: float
    high: float


def fit(
    p: Float[np.ndarray, "n"],
    failures: Float[np.ndarray, "n"],
    delivered: Float[np.ndarray, "n"],
    problems: Sequence[str],
) -> Fit:
    """The likeliest d where log-odds of delivery are logit(p) - d * failures. First tries say nothing of it.

    The interval is that of the sandwich estimator over problems: tries of one problem are alike.
    """
    offset = logit(np.clip(p, 1e-6, 1 - 1e-6))

    def slope(d: float) -> Float[np.ndarray, "n"]:
        return failures * (expit(offset - d * failures) - delivered)

    d = brentq(lambda d: float(slope(d).sum()), -_FURTHEST, _FURTHEST)
    q = expit(offset - d * failures)
    names = np.unique(problems, return_inverse=True)[1]
    of_problems = np.bincount(names, weights=slope(d))
    error = np.sqrt(np.sum(of_problems**2)) / np.sum(failures**2 * q * (1 - q))
    return Fit(d, d - 1.96 * error, d + 1.96 * error)


def table(rows: Sequence[dict]) -> str:
    """What was promised and what was delivered, by failures before."""
    lines = ["| failures before | tries | mean p | delivered |", "|---|---|---|---|"]
    for n in range(_MOST + 1):
        some = [r for r in rows if min(r["failures"], _MOST) == n]
        if some:
            p, done = np.mean([r["p"] for r in some]), np.mean([r["delivered"] for r in some])
            lines.append(f"| {n}{' or more' * (n == _MOST)} | {len(some)} | {p:.2f} | {done:.2f} |")
    return "\n".join(lines)


def main() -> None:
    """Gather, fit and print."""
    from torc.problems.sets import select_problems

    args = tyro.cli(Args, description=__doc__)
    args.out.mkdir(parents=True, exist_ok=True)
    files = {
        (problem, planner, seed): args.out / f"{Path(problem).stem}-{planner}-{args.log_odds:g}-{seed}.json"
        for seed in range(args.seeds)
        for problem in select_problems(args.problems)
        for planner in args.planners
    }
    missing = [(*key, args.log_odds, path) for key, path in files.items() if not path.exists()]
    run_jobs(gather, missing, args.workers)
    trials = [json.loads(path.read_text()) for path in files.values() if path.exists()]
    rows = [{**t, "problem": trial["problem"]} for trial in trials for t in trial["tries"]]
    print(f"{len(trials)} trials with {len(rows)} tries, each failure before taking {args.log_odds:g}\n")
    print(table(rows))
    columns = (np.array([float(r[name]) for r in rows]) for name in ("p", "failures", "delivered"))
    found = fit(*columns, [r["problem"] for r in rows])
    print(f"\nTo take further for every failure: {found.value:.2f} [{found.low:.2f}, {found.high:.2f}]")


if __name__ == "__main__":
    main()
