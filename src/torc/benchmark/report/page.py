"""The report as one HTML page that needs nothing else: no scripts, no network, pictures inside."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from torc.benchmark.report.board import MARKS, Board, Square, Went
from torc.benchmark.report.content import TextTable
from torc.benchmark.report.figures import Picture
from torc.benchmark.report.gallery import Failure
from torc.benchmark.report.links import Link
from torc.benchmark.report.verdict import Verdict

_STYLE = """
:root { color-scheme: light; --ink: #1e1e1e; --soft: #5b5b5b; --line: #dcdcdc; --mark: #0072b2; --warn: #8a4b00; }
body { font: 15px/1.45 system-ui, sans-serif; color: var(--ink); margin: 0 auto; max-width: 1240px;
  padding: 12px 20px 60px; }
h1 { font-size: 20px; margin: 4px 0 8px; } h2 { font-size: 18px; margin: 34px 0 8px; }
.answer { border-left: 6px solid var(--mark); background: #eef5fa; padding: 10px 16px; margin: 0 0 12px; }
.answer p { margin: 4px 0; } .answer .it { font-size: 21px; font-weight: 650; }
.warn { color: var(--warn); } .warn::before { content: "Note: "; font-weight: 650; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; }
th, td { text-align: left; padding: 4px 10px 4px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th { font-weight: 650; } td { font-variant-numeric: tabular-nums; } td.code { white-space: nowrap; }
tr.best td { font-weight: 650; background: #eef5fa; }
.note { color: var(--soft); font-size: 13px; max-width: 100ch; margin: 6px 0; }
.figures { display: flex; flex-wrap: wrap; gap: 20px 28px; } figure { margin: 0; max-width: 590px; }
figure img { max-width: 100%; height: auto; } figcaption { font-size: 13px; color: var(--soft); }
figcaption b { color: var(--ink); } .wide figure { max-width: 100%; }
.failures { display: grid; grid-template-columns: repeat(auto-fill, minmax(270px, 1fr)); gap: 18px; }
.failures img { width: 100%; border: 1px solid var(--line); } .failures p { margin: 3px 0; font-size: 13px; }
.board td { padding: 2px 14px 2px 0; } .squares > * { display: inline-block; min-width: 27px;
  padding: 0 3px; margin: 1px; line-height: 20px; text-align: center; border: 1px solid transparent; border-radius: 3px;
  box-sizing: border-box; text-decoration: none; color: var(--ink); }
.squares .clean { background: #0072b2; color: #fff; } .squares .drops { background: #b9ddf3; border-color: #0072b2; }
.squares .failed { background: #a83f00; color: #fff; } .squares .errored { border: 1px dashed var(--ink); }
.squares a:hover, .squares a:focus-visible { outline: 2px solid var(--ink); outline-offset: 1px; }
a { color: var(--mark); } a code { color: inherit; }
code { font: 12px ui-monospace, monospace; overflow-wrap: anywhere; }
summary { cursor: pointer; font-weight: 650; margin: 8px 0; }
nav { font-size: 13px; } nav a { margin-right: 14px; color: var(--mark); }
@media print { details > *:not(summary) { display: block; } }
"""
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


@dataclass(frozen=True)
class Content:
    """All that a report says.

    Attributes:
        title: of the page.
        verdict: the answer.
        ranking: the first table.
        references: the second one: who does not compete.
        paper_figures, figures: the paper's figures from our trials, and further ones.
        tables: shown openly, in order.
        details: long ones, shown when asked for.
        failures: the gallery.
        failed: how many trials failed in all.
        board: every trial as a square.
        view_command: what makes the links to trials work; "" where there are none.
        method: paragraphs on how it was made.
    """

    title: str
    verdict: Verdict
    ranking: TextTable
    references: TextTable
    paper_figures: Sequence[Picture]
    figures: Sequence[Picture]
    tables: Sequence[TextTable]
    details: Sequence[TextTable]
    failures: Sequence[Failure]
    failed: int
    board: Board
    view_command: str
    method: Sequence[str]


def html_page(content: Content) -> str:
    """The page."""
    best = content.verdict.planner
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(content.title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>Which planner should I use? <small>{escape(content.title)}</small></h1>",
        _answer(content.verdict),
        _table(content.ranking, best, heading=False),
        _table(content.references, None) if content.references.rows else "",
        '<nav><a href="#figures">Figures</a><a href="#tables">Tables</a><a href="#trials">Every trial</a>'
        '<a href="#failures">Failures</a><a href="#details">Every trial in numbers</a>'
        '<a href="#method">How this was made</a></nav>',
        '<h2 id="figures">The paper\'s figures, from these trials</h2>',
        f'<div class="figures">{"".join(map(_figure, content.paper_figures))}</div>',
        f'<div class="figures wide">{"".join(map(_figure, content.figures))}</div>',
        '<div id="tables">',
        *(_table(t, best) for t in content.tables if t.rows),
        "</div>",
        _board(content.board, content.view_command),
        _gallery(content.failures, content.failed),
        '<h2 id="details">Every problem and trial in numbers</h2>',
        *(_details(t) for t in content.details if t.rows),
        '<h2 id="method">How this was made</h2>',
        *(f'<p class="note">{escape(p)}</p>' for p in content.method),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _answer(verdict: Verdict) -> str:
    lines = [f'<p class="it">{escape(verdict.answer)}</p>']
    lines += [f"<p>{escape(reason)}</p>" for reason in verdict.reasons]
    lines += [f'<p class="warn">{escape(warning)}</p>' for warning in verdict.warnings]
    return f'<div class="answer">{"".join(lines)}</div>'


def _table(table: TextTable, best: str | None, *, heading: bool = True) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in table.header)
    rows = "".join(_row(row, best) for row in table.rows)
    title = f"<h2>{escape(table.title)}</h2>" if heading else ""
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return f'{title}<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>{note}'


def _row(cells: Sequence[str | Link], best: str | None) -> str:
    mark = ' class="best"' if best is not None and best in cells[:2] else ""
    return f"<tr{mark}>{''.join(map(_cell, cells))}</tr>"


def _cell(cell: str | Link) -> str:
    if isinstance(cell, Link):
        return f'<td class="code">{_linked(f"<code>{escape(cell.text)}</code>", cell.address)}</td>'
    return f"<td>{escape(cell)}</td>"


def _linked(inner: str, address: str | None) -> str:
    """HTML with a link around it."""
    return inner if address is None else f'<a href="{escape(address)}">{inner}</a>'


def _board(board: Board, command: str) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *board.planners))
    rows = "".join(
        f"<tr><th>{escape(problem)}</th>{''.join(map(_squares, cells))}</tr>" for problem, cells in board.rows
    )
    key = (
        f"{_key(Went.CLEAN, '4')} retrieved in 4 picks, {_key(Went.DROPS, '4')} the same, but with drops, "
        f"{_key(Went.FAILED)} not retrieved, {_key(Went.ERRORED)} errored, {_key(Went.MISSING)} not played yet"
    )
    links = " A square is a link to the trial, pick by pick. Links to trials work while"
    links = f"{links} <code>{escape(command)}</code> runs." if command else ""
    return (
        f'<h2 id="trials">Every trial</h2><p class="note">A square per seed: {key}.{links}</p>'
        f'<div class="scroll"><table class="board"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
    )


def _key(went: Went, text: str = "") -> str:
    return f'<span class="squares"><span class="{went}">{text or MARKS[went]}</span></span>'


def _squares(squares: Sequence[Square]) -> str:
    return f'<td class="squares">{"".join(map(_square, squares))}</td>'


def _square(square: Square) -> str:
    facts = f'class="{square.went}" title="{escape(square.title)}"'
    if square.address is None:
        return f"<span {facts}>{square.text}</span>"
    return f'<a {facts} href="{escape(square.address)}">{square.text}</a>'


def _details(table: TextTable) -> str:
    title = f"{escape(table.title)} ({len(table.rows)})"
    return f"<details><summary>{title}</summary>{_table(table, None, heading=False)}</details>"


def _figure(picture: Picture) -> str:
    image = base64.b64encode(picture.svg).decode()
    return (
        f'<figure><img alt="{escape(picture.title)}. {escape(picture.text)}" src="data:image/svg+xml;base64,{image}">'
        f"<figcaption><b>{escape(picture.title)}</b>. {escape(picture.text)}</figcaption></figure>"
    )


def _gallery(failures: Sequence[Failure], failed: int) -> str:
    told = (
        "No completed trial failed."
        if not failed
        else f"{len(failures)} of {failed} failed trials, causes in turn. A picture leads to that pick in the viewer."
    )
    cards = "".join(
        f"<div>{_linked(f'{_failure_image(f)}<p><b>{escape(f.title)}</b></p>', f.address)}<p>{escape(f.text)}</p></div>"
        for f in failures
    )
    return f'<h2 id="failures">Failures</h2><p class="note">{told}</p><div class="failures">{cards}</div>'


def _failure_image(failure: Failure) -> str:
    if failure.jpeg is None:
        return ""
    return f'<img alt="{escape(failure.title)}: the pick that failed" src="{failure.data_uri}">'
