"""Content of the report: tables, every trial as a square with a link, pictures of what went wrong in failed ones."""

import io
import shlex
from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from PIL import Image

from torc.benchmark.rows import Table, TrialRow
from torc.io.pictures import data_url
from torc.trials.recorded import LOG
from torc.trials.viewer_links import trial_link


@dataclass(frozen=True)
class Link:
    """Text with an address, if it has one; `kind` is "code", or how a trial went, which `title` says in words."""

    text: str
    address: str | None = None
    kind: str = ""
    title: str = ""


Cell = str | Link | tuple[Link, ...]


@dataclass(frozen=True)
class TextTable:
    """A table for the pages. `note` says how to read it."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""

    @classmethod
    def of(cls, title: str, rows: Sequence[Mapping[str, Cell]], note: str = "") -> "TextTable":
        """Return the table of rows that have the same columns by name; the default note is the one of words.md."""
        header, cells = tuple(rows[0]) if rows else (), [tuple(row.values()) for row in rows]
        return cls(title, header, cells, note or " ".join(words().get(title, ())))


@cache
def words() -> dict[str, list[str]]:
    """Return the paragraphs of words.md by their headings."""
    text = (files("torc.benchmark.report") / "words.md").read_text(encoding="utf-8")
    parts = (part.partition("\n") for part in text.split("\n## ")[1:])
    return {title: [" ".join(p.split()) for p in body.strip().split("\n\n")] for title, _, body in parts}


def address_of(table: Table, row: TrialRow, pick: int = 0) -> str | None:
    """Return the link to a pick of a trial; None for trials without a log, and where no viewer shows all trials.

    In a viewer's page it leads to the pick, in the file of the report to the trial's `Opening`.
    """
    shown = table.has_place and (row.directory / LOG).is_file()
    return trial_link(table.root, row.directory, pick) if shown else None


def trial_cell(table: Table, row: TrialRow) -> Link | str:
    """Return the directory of a trial, a link if the viewer can show it."""
    address, name = address_of(table, row), row.directory.relative_to(table.root).as_posix()
    return name if address is None else Link(name, address, "code")


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
    cells: dict[tuple[str, str], list[Link]] = defaultdict(list)
    for row in table.rows:
        cells[row.problem, row.planner].append(_square(table, row))
    rows: list[tuple[Cell, ...]] = [
        (name, *(tuple(cells[name, p]) for p in planners)) for name in table.problems
    ]
    return TextTable("Every trial", ("problem", *planners), rows)


def _square(table: Table, row: TrialRow) -> Link:
    """Show the picks if the target was retrieved, else a mark."""
    if not row.completed:
        kind, text = ("errored", _ERRORED) if row.played else ("missing", _MISSING)
        outcome = row.status
    else:
        solved = "drops" if row.drops else "clean"
        kind, text = (solved, str(row.picks)) if row.solved else ("failed", _FAILED)
        end = f"not there: {row.end}" if row.absent else f"not retrieved: {row.end}"
        end = "retrieved" if row.solved and not row.absent else end
        outcome = f"{end}, {row.picks} picks, {row.drops} dropped"
    return Link(text, address_of(table, row), kind, f"{row.title}: {outcome}")


@dataclass(frozen=True)
class Failure:
    """A failed trial in the gallery: the address of the pick that failed, and its picture as data URL, if any."""

    title: str
    text: str
    address: str | None
    picture: str


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
        for pick in {0, failed.pick if failed else 0}:
            if address := address_of(table, row, pick):
                title = f"{row.title}, pick {pick + 1}" if pick else row.title
                command = f"torc view {shlex.quote(str(row.directory))} --open"
                found[address] = Opening(address, title, command)
    return list(found.values())


def _failure(table: Table, row: TrialRow) -> Failure:
    pick, text, picture = row.failed_pick, f"{row.end} after {row.picks} picks", ""
    if pick is not None:
        said = f": {pick.detail}" if pick.detail else ""
        text += f". Pick {pick.pick + 1}, object {pick.object_id}: {pick.result}{said}"
        picture = _small(row.directory / "picks" / f"{pick.pick:02d}_seen.png")
    return Failure(row.title, text, address_of(table, row, pick.pick if pick else 0), picture)


def _small(picture: Path) -> str:
    """Return a small copy as data URL; "" if there is no readable picture."""
    try:
        image = Image.open(picture).convert("RGB")
    except (OSError, ValueError):
        return ""
    image.thumbnail((_MAX_WIDTH, 10 * _MAX_WIDTH))
    encoded = io.BytesIO()
    image.save(encoded, "JPEG", quality=_JPEG_QUALITY)
    return data_url(encoded.getvalue())
