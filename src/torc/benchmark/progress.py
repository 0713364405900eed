"""Progress of a benchmark: a live line on a terminal, a line per trial elsewhere."""

import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from torc.benchmark.playing import Listener
from torc.benchmark.spec import PlannedTrial
from torc.episode.log import TrialResult

_PACE_S = 3600.0
"""The remaining time follows from the pace of the last hour."""


@contextmanager
def shown(total: int) -> Iterator[Listener]:
    """Provide a listener that shows progress on standard error while the context lasts."""
    console, played, retrieved = Console(file=sys.stderr), Counter[str](), Counter[str]()
    so_far = TextColumn("retrieved: {task.description}", markup=False)
    columns = (MofNCompleteColumn(), BarColumn(24), TimeRemainingColumn(), so_far)
    live = console.is_terminal
    with Progress(*columns, console=console, disable=not live, speed_estimate_period=_PACE_S) as progress:
        bar = progress.add_task("", total=total)

        def listen(trial: PlannedTrial, result: TrialResult) -> None:
            progress.advance(bar)
            completed, label = result.completed, trial.planner.label
            if completed:
                verdict = "retrieved" if result.retrieved else f"not retrieved ({result.end})"
                verdict += f", {result.picks} picks, {result.drops} dropped"
                played[label] += 1
                retrieved[label] += bool(result.retrieved)
            else:
                verdict = f"ERRORED: {result.error or result.status}"
            if not (live and completed):
                where = f"[{progress.tasks[bar].completed:.0f}/{total}] {label} on {trial.problem.name}"
                console.out(f"{where}, seed {trial.seed}: {verdict}", highlight=False)
            told = ", ".join(f"{label} {retrieved[label]}/{n}" for label, n in played.items())
            progress.update(bar, description=told)

        yield listen
