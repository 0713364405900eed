"""Every trial as a square with a link, and pictures of what went wrong in failed ones."""

import base64
import io
import shlex
from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from torc.benchmark.report.cells import Cell, Link, TextTable, address_of, outcome
from torc.benchmark.rows import Table, TrialRow

_FAILED, _ERRORED, _MISSING = "\N{MULTIPLICATION X}", "!", "\N{MIDDLE DOT}"
KEY: tuple[str | Link, ...] = (
    *("A square per seed: ", Link("4", kind="clean"), " retrieved in 4 picks, "),
    *(Link("4", kind="drops"), " the same, but with drops, "),
    *(Link(_FAILED, kind="failed"), " not retrieved, "),
    *(Link(_ERRORED, kind="errored"), " errored, ", Link(_MISSING, kind="missing"), " not played yet."),
)
"""How to read the table of trials."""
_MAX_WIDTH, _JPEG_QUALITY = 480, 78


def trial_board(table: Table, planners: Sequence[str]) -> TextTable:
    """Return a square per trial: problems down, planners across in the given order, seeds side by side."""
    cells: dict[tuple[str, str], tuple[Link, ...]] = defaultdict(tuple)
    for row in table.rows:
        cells[row.problem, row.planner] += (_square(table, row),)
    rows: list[tuple[Cell, ...]] = [(name, *(cells[name, p] for p in planners)) for name in table.problems]
    return TextTable("Every trial", ("problem", *planners), rows)


def _square(table: Table, row: TrialRow) -> Link:
    """Show the picks if the target was retrieved, else a mark."""
    if not row.completed:
        kind, text = ("missing", _MISSING) if row.status == "missing" else ("errored", _ERRORED)
    elif not row.solved:
        kind, text = "failed", _FAILED
    else:
        kind, text = "drops" if row.drops else "clean", str(row.picks)
    told = f"{outcome(row)}, {row.picks} picks, {row.drops} dropped" if row.completed else row.status
    return Link(text, address_of(table, row), kind, f"{row.title}: {told}")


@dataclass(frozen=True)
class Failure:
    """A failed trial in the gallery: the address of the pick that failed, and its picture in base64, if any."""

    title: str
    text: str
    address: str | None
    jpeg: str


def failures(table: Table, planners: Sequence[str], most: int) -> tuple[list[Failure], int]:
    """Return at most this many failed trials, planners and causes in turn; and the number of all."""
    queues: dict[tuple[str, str], deque[TrialRow]] = defaultdict(deque)
    for planner in planners:
        for row in table.completed(planner):
            if not row.solved:
                queues[planner, row.end].append(row)
    count = sum(map(len, queues.values()))
    chosen: list[TrialRow] = []
    while len(chosen) < min(most, count):
        chosen += [queue.popleft() for queue in queues.values() if queue]
    return [_failure(table, row) for row in chosen[:most]], count


@dataclass(frozen=True)
class Opening:
    """Text behind a link to a trial in the file of a report: how to see the trial, since no viewer may be running."""

    address: str
    title: str
    command: str


def openings(table: Table) -> list[Opening]:
    """Return an opening for each address that `trial_board` and `failures` link to."""
    found = dict[str, Opening]()
    for row in table.rows:
        failed = row.failed_pick if row.completed and not row.solved else None
        for pick in (0, failed.pick if failed else 0):
            address = address_of(table, row, pick)
            if address is not None:
                title = f"{row.title}, pick {pick + 1}" if pick else row.title
                found[address] = Opening(
                    address, title, f"torc view {shlex.quote(str(row.directory))} --open"
                )
    return list(found.values())


def _failure(table: Table, row: TrialRow) -> Failure:
    pick, text, jpeg = row.failed_pick, f"{row.end} after {row.picks} picks", ""
    if pick is not None:
        said = f": {pick.detail}" if pick.detail else ""
        text += f". Pick {pick.pick + 1}, object {pick.object_id}: {pick.result}{said}"
        jpeg = _small(row.directory / "picks" / f"{pick.pick:02d}_seen.png")
    return Failure(row.title, text, address_of(table, row, pick.pick if pick else 0), jpeg)


def _small(picture: Path) -> str:
    """Return a small copy as JPEG in base64; "" if there is no readable picture."""
    try:
        image = Image.open(picture).convert("RGB")
    except (OSError, ValueError):
        return ""
    image.thumbnail((_MAX_WIDTH, 10 * _MAX_WIDTH))
    encoded = io.BytesIO()
    image.save(encoded, "JPEG", quality=_JPEG_QUALITY)
    return base64.b64encode(encoded.getvalue()).decode()
