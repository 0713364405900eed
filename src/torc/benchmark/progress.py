"""How a benchmark is getting on: a live line on a terminal, a line per trial elsewhere."""

import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from torc.benchmark.playing import Listener
from torc.benchmark.spec import PlannedTrial

_PACE_S = 3600.0
"""The time that is left follows from the pace of the last hour."""


def trial_line(trial: PlannedTrial, result: dict[str, Any]) -> str:
    """A trial in one line."""
    name = f"{trial.planner.label} on {trial.problem.name}, seed {trial.seed}"
    if result.get("status") != "completed":
        return f"{name}: ERRORED: {result.get('error', result.get('status'))!s}"
    verdict = "retrieved" if result["retrieved"] else f"not retrieved ({result['end']})"
    return f"{name}: {verdict}, {result['picks']} picks, {result['drops']} dropped"


@contextmanager
def shown(total: int) -> Iterator[Listener]:
    """A listener that shows progress on standard error while the context lasts."""
    console, done = Console(file=sys.stderr), 0
    played, retrieved = Counter[str](), Counter[str]()
    so_far = TextColumn("retrieved: {task.description}", markup=False)
    columns = (MofNCompleteColumn(), BarColumn(24), TimeRemainingColumn(), so_far)
    live = console.is_terminal
    with Progress(*columns, console=console, disable=not live, speed_estimate_period=_PACE_S) as progress:
        bar = progress.add_task("", total=total)

        def listen(trial: PlannedTrial, result: dict[str, Any]) -> None:
            nonlocal done
            done += 1
            completed, label = result.get("status") == "completed", trial.planner.label
            played[label] += completed
            retrieved[label] += completed and bool(result["retrieved"])
            if not (live and completed):
                console.out(f"[{done}/{total}] {trial_line(trial, result)}", highlight=False)
            told = ", ".join(f"{label} {retrieved[label]}/{n}" for label, n in played.items() if n)
            progress.update(bar, advance=1, description=told)

        yield listen
