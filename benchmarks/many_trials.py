"""How long `torc report` takes over many trials, and how much memory: a store is made up from recorded trials.

    torc bench --problems torc40 --planners random,dg-select --repeats 1 --no-pictures --out runs/few
    python -m benchmarks.many_trials runs/few [--trials 1000 10000 100000]

Every made-up trial is a copy of the log and result of a recorded one, under a new seed. The files are warm: they were
just written. Making up 100,000 trials takes some minutes and 4 GB on the disk.
"""

import os
import shutil
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import tyro

from torc.benchmark.spec import PlannedTrial, make_spec
from torc.benchmark.store import Store
from torc.io.results import write_json
from torc.problems.problem import load_problem
from torc.specs.spec_files import to_plain


@dataclass(frozen=True)
class Args:
    """Time the report."""

    source: tyro.conf.Positional[Path]
    """A store of `torc bench` with completed trials, best without pictures."""
    trials: tuple[int, ...] = (1_000, 10_000, 100_000)
    at: Path | None = None
    """Keep the stores below this directory, and use those that are there; a temporary one by default."""


def make_up(source: Store, trials: int, out: Store) -> None:
    """Write a store of at least so many trials from those of another, on the problems that all its planners have."""
    old, recorded = source.spec(), defaultdict[tuple[str, str], list[PlannedTrial]](list)
    for trial in old.trials:
        if (result := source.result(trial)) is not None and result.completed:
            recorded[trial.cell[:2]].append(trial)
    problems = [p for p in old.problems if all((who.label, p.name) in recorded for who in old.planners)]
    seeds = range(-(-trials // (len(problems) * len(old.planners))))
    spec = make_spec(problems, old.planners, seeds, old.around, old.trials[0].version)
    out.extend(spec, {p.name: load_problem(source.problem_path(p)) for p in problems})
    for trial in spec.trials:
        alike = recorded[trial.cell[:2]]
        like, place = source.directory(alike[trial.seed % len(alike)]), out.directory(trial)
        place.mkdir()
        write_json(place / "spec.json", to_plain(trial.spec(out.problem_path(trial.problem)), trial.sources))
        for name in ("events.jsonl", "result.json"):
            shutil.copyfile(like / name, place / name)


def report(store: Path) -> str:
    """Report on a store in a child process; return a row of the table."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "torc.cli.main", "report", str(store)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    wall = time.perf_counter() - start
    if status:
        raise SystemExit(f"torc report {store} failed.")
    page, table = ((store / "report" / name).stat().st_size / 1e6 for name in ("index.html", "picks.csv"))
    spent = f"{wall:.1f} | {usage.ru_utime + usage.ru_stime:.1f} | {usage.ru_maxrss / 2**20:.2f}"
    return f"{spent} | {page:.1f} | {table:.1f}"


def main(args: Args) -> None:
    """Print a row per number of trials."""
    print("| trials | seconds | processor, s | peak memory, GiB | page, MB | picks.csv, MB |")
    print("|---|---|---|---|---|---|")
    with TemporaryDirectory() as own:
        for trials in args.trials:
            store = Store((args.at or Path(own)) / str(trials))
            if not store.is_there:
                make_up(Store(args.source), trials, store)
            print(f"| {len(store.spec().trials):,} | {report(store.root)} |", flush=True)


if __name__ == "__main__":
    main(tyro.cli(Args))
