"""The report as one Markdown page, its figures beside it."""

import re
from collections.abc import Iterator

from torc.benchmark.report.board import MARKS, Board, Square, Went
from torc.benchmark.report.content import TextTable
from torc.benchmark.report.figures import Picture
from torc.benchmark.report.links import Link
from torc.benchmark.report.page import Content

_SPECIAL = re.compile(r"([\\`*_{}\[\]<>|#])")


def markdown_page(content: Content, figures: str) -> str:
    """The page; `figures` is the directory of the pictures, relative to it. Every trial is in trials.csv beside it."""
    return "\n".join(_lines(content, figures))


def _lines(content: Content, figures: str) -> Iterator[str]:
    yield f"# Which planner should I use? {_plain(content.title)}\n"
    yield f"**{_plain(content.verdict.answer)}**\n"
    for reason in content.verdict.reasons:
        yield f"{_plain(reason)}\n"
    for warning in content.verdict.warnings:
        yield f"> {_plain(warning)}\n"
    yield from _table(content.ranking)
    if content.references.rows:
        yield f"## {_plain(content.references.title)}\n"
        yield from _table(content.references)
    yield "## Figures\n"
    for picture in (*content.paper_figures, *content.figures):
        yield from _picture(picture, figures)
    for table in content.tables:
        if table.rows:
            yield f"## {_plain(table.title)}\n"
            yield from _table(table)
    if content.failures:
        yield f"## Failures\n\n{len(content.failures)} of {content.failed} failed trials.\n"
        for failure in content.failures:
            yield f"- {_linked(failure.title, failure.address)}: {_plain(failure.text)}."
        yield ""
    yield "## Every trial\n"
    yield f"Picks to retrieval, seeds in turn; {MARKS[Went.FAILED]}: not retrieved; {MARKS[Went.ERRORED]}: errored.\n"
    if content.view_command:
        yield f"Each is a link to the trial; links to trials work while `{content.view_command}` runs.\n"
    yield from _board(content.board)
    yield "## How this was made\n"
    for paragraph in content.method:
        yield f"{_plain(paragraph)}\n"


def _table(table: TextTable) -> Iterator[str]:
    yield f"| {' | '.join(map(_plain, table.header))} |"
    yield "|---" * len(table.header) + "|"
    for row in table.rows:
        yield f"| {' | '.join(map(_cell, row))} |"
    yield ""
    if table.note:
        yield f"{_plain(table.note)}\n"


def _cell(cell: str | Link) -> str:
    return _linked(cell.text, cell.address) if isinstance(cell, Link) else _plain(cell)


def _linked(text: str, address: str | None) -> str:
    return _plain(text) if address is None else f"[{_plain(text)}]({address})"


def _board(board: Board) -> Iterator[str]:
    yield f"| problem | {' | '.join(map(_plain, board.planners))} |"
    yield "|---" * (len(board.planners) + 1) + "|"
    for problem, cells in board.rows:
        yield f"| {_plain(problem)} | {' | '.join(' '.join(map(_square, c)) for c in cells)} |"
    yield ""


def _square(square: Square) -> str:
    return _linked(square.text, square.address)


def _picture(picture: Picture, figures: str) -> Iterator[str]:
    yield f"![{_plain(picture.title)}]({figures}/{picture.name}.svg)\n"
    yield f"*{_plain(picture.title)}.* {_plain(picture.text)}\n"


def _plain(text: str) -> str:
    """Text that Markdown shows as it is."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))
