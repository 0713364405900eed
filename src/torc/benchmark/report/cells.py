"""Content of the report: tables, links to trials in the viewer, numbers in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from torc.benchmark.intervals import Estimate
from torc.benchmark.rows import Table, TrialRow
from torc.episode.recorded import LOG
from torc.episode.viewer_links import trial_link


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


def outcome(row: TrialRow) -> str:
    """Return how a trial ended, in words."""
    if not row.completed:
        return row.status
    if row.absent:
        return f"not there: {row.end}"
    return "retrieved" if row.solved else f"not retrieved: {row.end}"


def signed_text(found: Estimate, digits: int) -> str:
    """Return a difference with its interval and signs; empty if there is none."""
    if not np.isfinite(found.value):
        return ""
    low, high = (f"{v:+.{digits}f}" if np.isfinite(v) else "?" for v in (found.low, found.high))
    return f"{found.value:+.{digits}f} [{low}, {high}]"


def seconds_text(found: Estimate) -> str:
    """Return the value alone, in two significant digits."""
    return found.text(None).partition(" ")[0]
