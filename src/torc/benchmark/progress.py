"""How a benchmark is getting on: a live line on a terminal, a line per trial elsewhere."""

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn

from torc.benchmark.runner import Played


class Tally:
    """Counts what has ended of so many trials; `clock` gives seconds."""

    def __init__(self, total: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.total, self._clock, self._begun = total, clock, clock()
        self.done, self.errored = 0, 0
        self._completed: Counter[str] = Counter()
        self._retrieved: Counter[str] = Counter()

    def add(self, played: Played) -> None:
        """Count a trial."""
        self.done += 1
        self.errored += not played.completed
        label = played.trial.planner.label
        self._completed[label] += played.completed
        self._retrieved[label] += played.completed and bool(played.result.get("retrieved"))

    @property
    def pace(self) -> str:
        """Rate and what is left, e.g. "9.2 a minute, 7 min left"; empty before the first."""
        seconds = self._clock() - self._begun
        if not self.done or seconds <= 0:
            return ""
        left = _time((self.total - self.done) * seconds / self.done)
        return f"{60 * self.done / seconds:.3g} a minute, {left} left"

    @property
    def so_far(self) -> str:
        """Retrieved of completed per planner, and the errored ones."""
        parts = [f"{label} {self._retrieved[label]}/{n}" for label, n in self._completed.items() if n]
        told = [f"retrieved: {', '.join(parts)}"] if parts else []
        return "; ".join(told + ([f"errored: {self.errored}"] if self.errored else []))


def line_of(played: Played) -> str:
    """A trial in one line."""
    trial, result = played.trial, played.result
    name = f"{trial.planner.label} on {trial.problem.name}, seed {trial.seed}"
    if not played.completed:
        return f"{name}: ERRORED: {result.get('error', result.get('status'))!s}"
    verdict = "retrieved" if result["retrieved"] else f"not retrieved ({result['end']})"
    return f"{name}: {verdict}, {result['picks']} picks, {result['drops']} dropped"


@contextmanager
def shown(total: int, stream: TextIO | None = None) -> Iterator[Callable[[Played], None]]:
    """A listener that shows progress on a stream (standard error if none is given) while the context lasts."""
    stream = stream or sys.stderr
    console, tally = Console(file=stream), Tally(total)

    def plain(played: Played) -> None:
        tally.add(played)
        print(f"[{tally.done}/{total}] {line_of(played)} | {tally.pace}", file=stream, flush=True)

    if not console.is_terminal:
        yield plain
        return
    told = (TextColumn("{task.fields[pace]}"), TextColumn("{task.fields[so_far]}"))
    columns = (TextColumn("{task.completed}/{task.total}"), BarColumn(bar_width=24), *told)
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task("", total=total, pace="starting...", so_far="")

        def live(played: Played) -> None:
            tally.add(played)
            if not played.completed:
                progress.console.print(f"[red]{escape(line_of(played))}[/]", highlight=False)
            progress.update(bar, completed=tally.done, pace=tally.pace, so_far=escape(tally.so_far))

        yield live


def _time(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 90 * 60 else f"{seconds / 3600:.1f} h"
