"""The report as one HTML page that needs nothing else (no scripts, no network, pictures inside), and as Markdown."""

import base64
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

from torc.benchmark.report.cells import Cell, Link, TextTable
from torc.benchmark.report.figures import Picture
from torc.benchmark.report.trials import Failure
from torc.benchmark.report.verdict import Verdict

Paragraph = tuple[str | Link, ...]
Block = str | Paragraph | TextTable | Picture | Failure
QUESTION = "Which planner should I use?"
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
figcaption b { color: var(--ink); } .wide { max-width: 100%; }
.failures { display: grid; grid-template-columns: repeat(auto-fill, minmax(270px, 1fr)); gap: 18px; }
.failures img { width: 100%; border: 1px solid var(--line); } .failures p { margin: 3px 0; font-size: 13px; }
.square { display: inline-block; min-width: 27px; padding: 0 3px; margin: 1px; line-height: 20px; text-align: center;
  border: 1px solid transparent; border-radius: 3px; box-sizing: border-box; text-decoration: none; color: var(--ink); }
.clean { background: #0072b2; color: #fff; } .drops { background: #b9ddf3; border-color: #0072b2; }
.failed { background: #a83f00; color: #fff; } .errored { border: 1px dashed var(--ink); }
a.square:hover, a.square:focus-visible { outline: 2px solid var(--ink); outline-offset: 1px; }
a { color: var(--mark); } a code { color: inherit; }
code { font: 12px ui-monospace, monospace; overflow-wrap: anywhere; }
summary { cursor: pointer; font-weight: 650; margin: 8px 0; }
nav { font-size: 13px; } nav a { margin-right: 14px; color: var(--mark); }
@media print { details > *:not(summary) { display: block; } }
"""
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
_SPECIAL = re.compile(r"([\\`*_{}\[\]<>|#])")


@dataclass(frozen=True)
class Section:
    """A part of the report.

    Attributes:
        title: its heading; "" for none.
        blocks: paragraphs, tables, figures, failures.
        anchor: the page's navigation leads there; "" if it does not.
        folded: long tables, which only the HTML page has, shown when asked for.
    """

    title: str
    blocks: Sequence[Block]
    anchor: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Page:
    """All that a report says: an answer, then sections."""

    title: str
    verdict: Verdict
    sections: Sequence[Section]


def html_page(page: Page) -> str:
    """The report as HTML."""
    verdict, title = page.verdict, escape(page.title)
    paragraphs = [("it", verdict.answer), *(("", r) for r in verdict.reasons)]
    paragraphs += [("warn", w) for w in verdict.warnings]
    answer = "".join(f'<p class="{kind}">{escape(text)}</p>' for kind, text in paragraphs)
    links = "".join(f'<a href="#{s.anchor}">{escape(s.title)}</a>' for s in page.sections if s.anchor)
    parts = [
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{title}</title><style>{_STYLE}</style></head><body>",
        f'<h1>{QUESTION} <small>{title}</small></h1><div class="answer">{answer}</div>',
    ]
    for number, section in enumerate(page.sections):
        if section.anchor and not any(s.anchor for s in page.sections[:number]):
            parts.append(f"<nav>{links}</nav>")
        anchor = f' id="{section.anchor}"' if section.anchor else ""
        parts.append(f"<h2{anchor}>{escape(section.title)}</h2>" if section.title else "")
        parts += _html_blocks(section, verdict.planner)
    return "\n".join([*parts, "</body></html>"]) + "\n"


def _html_blocks(section: Section, best: str | None) -> Iterator[str]:
    pictures = [_html_picture(b) for b in section.blocks if isinstance(b, Picture)]
    failures = [_html_failure(b) for b in section.blocks if isinstance(b, Failure)]
    for block in section.blocks:
        if isinstance(block, TextTable):
            summary = f"<summary>{escape(block.title)} ({len(block.rows)})</summary>"
            table = _html_table(block, None if section.folded else best)
            yield f"<details>{summary}{table}</details>" if section.folded else table
        elif isinstance(block, str | tuple):
            yield f'<p class="note">{_paragraph(block, _html_inline)}</p>'
    for name, found in (("figures", pictures), ("failures", failures)):
        if found:
            yield f'<div class="{name}">{"".join(found)}</div>'


def _html_table(table: TextTable, best: str | None) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in table.header)
    rows = ""
    for row in table.rows:
        mark = ' class="best"' if best is not None and best in row[:2] else ""
        rows += f"<tr{mark}>{''.join(map(_html_cell, row))}</tr>"
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return (
        f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>{note}'
    )


def _html_cell(cell: Cell) -> str:
    code = ' class="code"' if isinstance(cell, Link) and cell.kind == "code" else ""
    return f"<td{code}>{_paragraph(cell, _html_inline)}</td>"


def _html_inline(cell: str | Link) -> str:
    if isinstance(cell, str):
        return escape(cell)
    inner, facts = escape(cell.text), ""
    if cell.kind == "code":
        inner = f"<code>{inner}</code>"
    elif cell.kind:
        facts = f' class="square {cell.kind}" title="{escape(cell.title)}"'
    return f"<span{facts}>{inner}</span>" if cell.address is None else _html_link(inner, cell.address, facts)


def _html_link(inner: str, address: str | None, facts: str = "") -> str:
    return inner if address is None else f'<a{facts} href="{escape(address)}">{inner}</a>'


def _html_picture(picture: Picture) -> str:
    title, text, wide = escape(picture.title), escape(picture.text), ' class="wide"' if picture.wide else ""
    source = f"data:image/svg+xml;base64,{base64.b64encode(picture.svg).decode()}"
    image = f'<img alt="{title}. {text}" src="{source}">'
    return f"<figure{wide}>{image}<figcaption><b>{title}</b>. {text}</figcaption></figure>"


def _html_failure(failure: Failure) -> str:
    title, image = escape(failure.title), ""
    if failure.jpeg:
        image = f'<img alt="{title}: the pick that failed" src="data:image/jpeg;base64,{failure.jpeg}">'
    return f"<div>{_html_link(f'{image}<p><b>{title}</b></p>', failure.address)}<p>{escape(failure.text)}</p></div>"


def markdown_page(page: Page, figures: str) -> str:
    """The report as Markdown; `figures` is the directory of the pictures, relative to it."""
    verdict = page.verdict
    lines = [f"# {QUESTION} {_plain(page.title)}", f"**{_plain(verdict.answer)}**"]
    lines += [_plain(reason) for reason in verdict.reasons]
    lines += [f"> {_plain(warning)}" for warning in verdict.warnings]
    for section in page.sections:
        if not section.folded:
            lines += [f"## {_plain(section.title)}"] if section.title else []
            lines += [_markdown_block(block, figures) for block in section.blocks]
    return "\n\n".join(lines) + "\n"


def _markdown_block(block: Block, figures: str) -> str:
    if isinstance(block, TextTable):
        rows = [f"| {' | '.join(map(_plain, block.header))} |", "|---" * len(block.header) + "|"]
        rows += [f"| {' | '.join(_paragraph(c, _markdown_inline, ' ') for c in row)} |" for row in block.rows]
        return "\n".join(rows) + (f"\n\n{_plain(block.note)}" if block.note else "")
    if isinstance(block, Picture):
        title = _plain(block.title)
        return f"![{title}]({figures}/{block.name}.svg)\n\n*{title}.* {_plain(block.text)}"
    if isinstance(block, Failure):
        return f"- {_markdown_inline(Link(block.title, block.address))}: {_plain(block.text)}."
    return _paragraph(block, _markdown_inline)


def _markdown_inline(cell: str | Link) -> str:
    if isinstance(cell, str):
        return _plain(cell)
    if cell.address is None and cell.kind == "code":
        return f"`{cell.text}`"
    text = f"*{_plain(cell.text)}*" if cell.kind == "drops" else _plain(cell.text)
    return text if cell.address is None else f"[{text}]({cell.address})"


def _paragraph(cell: Cell | Paragraph, inline: Callable[[str | Link], str], between: str = "") -> str:
    return between.join(map(inline, cell)) if isinstance(cell, tuple) else inline(cell)


def _plain(text: str) -> str:
    """Text that Markdown shows as it is."""
    return _SPECIAL.sub(r"\\\1", re.sub(r"\s+", " ", text))
