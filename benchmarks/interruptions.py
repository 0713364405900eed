"""Kills a benchmark again and again and compares what it ends with to one left alone.

    python -m benchmarks.interruptions --problems validation --repeats 9 --kills 10

Plays the same trials into two directories. One runner is left alone; the other gets SIGKILL, which nobody can catch, at
random moments, is started again each time, and at last left to end. All rows of the two tables, a row per trial and a
row per pick, must be equal but for the seconds that computing took.
"""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from torc.benchmark.reading import read_table
from torc.benchmark.rows import pick_records, trial_records
from torc.benchmark.store import Store

_SHORTEST_S = 2.0
"""A runner needs some time to get going."""


@dataclass(frozen=True)
class Args:
    """What is played, and how often it is killed."""

    problems: str = "validation"
    """As for `torc bench`."""
    planners: str = "random,dg-select"
    """As for `torc bench`."""
    repeats: int = 9
    """Trials of each planner on each problem."""
    kills: int = 10
    """How often."""
    workers: int = 2
    """As for `torc bench`."""
    seed: int = 0
    """Of the moments."""
    out: Path = Path("runs/interruptions")
    """Directory of the two benchmarks; played trials are kept."""


def command(args: Args, out: Path) -> list[str]:
    """The benchmark, the same for both but for where it goes."""
    options = {"problems": args.problems, "planners": args.planners, "repeats": args.repeats}
    words = [w for name, value in options.items() for w in (f"--{name}", str(value))]
    return [
        sys.executable,
        "-m",
        "torc.cli.main",
        "bench",
        *words,
        "--workers",
        str(args.workers),
        "--out",
        str(out),
    ]


def kill_often(args: Args, out: Path, whole_s: float) -> int:
    """Starts and kills runners; how many were killed. Ends early if one reaches the end."""
    rng = np.random.default_rng(args.seed)
    longest_s = max(2 * _SHORTEST_S, 2 * whole_s / (args.kills + 2))
    for kill in range(args.kills):
        runner = subprocess.Popen(command(args, out), stdout=subprocess.DEVNULL)
        wait_s = float(rng.uniform(_SHORTEST_S, longest_s))
        try:
            runner.wait(wait_s)
        except subprocess.TimeoutExpired:
            os.kill(runner.pid, signal.SIGKILL)
            runner.wait()
        else:
            return kill
        print(f"killed after {wait_s:5.1f} s: {complete(out)} trials are complete", flush=True)
    return args.kills


def complete(out: Path) -> int:
    """Trials with a result."""
    return len(list(out.glob("trials/*/result.json")))


def rows(out: Path) -> list[dict[str, Any]]:
    """Both tables without the seconds of computing."""
    table = read_table(out)
    seconds = {"decision_s", "planning_s", "grasps_s", "motions_s"}
    return [
        {k: v for k, v in record.items() if k not in seconds}
        for record in (*trial_records(table), *pick_records(table))
    ]


def main() -> None:
    """Play both, compare, print; exit code 1 if they differ."""
    args = tyro.cli(Args, description=__doc__)
    alone, killed = args.out / "alone", args.out / "killed"
    begin = time.perf_counter()
    subprocess.run(command(args, alone), check=True)
    whole_s = time.perf_counter() - begin
    print(f"left alone: {complete(alone)} trials in {whole_s:.0f} s", flush=True)
    kills = kill_often(args, killed, whole_s)
    subprocess.run(command(args, killed), check=True)
    played = [call.get("played") for call in Store(killed).calls()]
    same = rows(alone) == rows(killed)
    print(f"\n{kills} kills; the last call, which ended by itself, still played {played[-1]} trials.")
    print(f"{len(rows(alone))} rows of trials and picks are {'equal' if same else 'NOT EQUAL'}.")
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
