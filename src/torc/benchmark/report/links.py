"""Links from a report to the trials in the viewer."""

from dataclasses import dataclass

from torc.benchmark.rows import Table, TrialRow
from torc.episode.recorded import LOG
from torc.episode.viewer_links import trial_link


@dataclass(frozen=True)
class Link:
    """Text with an address."""

    text: str
    address: str


def address_of(table: Table, row: TrialRow, pick: int = 0) -> str | None:
    """Where the viewer shows a pick of a trial; None where there is nothing to show: not played, or without a log."""
    if not (row.directory / LOG).is_file():
        return None
    return trial_link(table.root, row.directory, pick)


def trial_cell(table: Table, row: TrialRow) -> Link | str:
    """The directory of a trial, relative to the table's; a link if the viewer can show it."""
    address = address_of(table, row)
    name = row.directory.relative_to(table.root).as_posix()
    return name if address is None else Link(name, address)
