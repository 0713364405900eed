"""The report as one self-contained HTML page (no scripts, no network, pictures inside), and as Markdown."""

import base64
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from string import Template

from torc.benchmark.report.cells import Cell, Failure, Link, Opening, TextTable
from torc.benchmark.report.figures import Picture
from torc.benchmark.report.ranking import Verdict

Paragraph = tuple[str | Link, ...]
Block = str | Paragraph | TextTable | Picture | Failure
QUESTION = "Which planner should I use?"
_SPECIAL = re.compile(r"([\\`*_{}\[\]<>|#])")


@dataclass(frozen=True)
class Section:
    """A part of the report; the page's navigation leads to its `anchor`, if it has one."""

    title: str
    blocks: Sequence[Block]
    anchor: str = ""


def html_page(
    title: str, verdict: Verdict, sections: Sequence[Section], openings: Sequence[Opening] = ()
) -> str:
    """Return the report as HTML. An opening appears when its link is followed."""
    told = [("it", verdict.answer)]
    told += [("", reason) for reason in verdict.reasons]
    told += [("warn", warning) for warning in verdict.warnings]
    links = "".join(f'<a href="#{s.anchor}">{escape(s.title)}</a>' for s in sections if s.anchor)
    parts = []
    first = next(s for s in sections if s.anchor)
    for section in sections:
        parts += [f"<nav>{links}</nav>"] if section is first else []
        anchor = f' id="{section.anchor}"' if section.anchor else ""
        parts += [f"<h2{anchor}>{escape(section.title)}</h2>"] if section.title else []
        parts += _html_blocks(section, verdict.planner)
    template = (files("torc.benchmark.report") / "page.html").read_text(encoding="utf-8")
    return Template(template).substitute(
        question=QUESTION,
        title=escape(title),
        answer="".join(f'<p class="{kind}">{escape(text)}</p>' for kind, text in told),
        parts="\n".join([*parts, *map(_html_opening, openings)]),
    )


def _html_opening(opening: Opening) -> str:
    where, title = escape(opening.address.removeprefix("#")), escape(opening.title)
    how = f"<b>{title}</b>. To see it pick by pick: <code>{escape(opening.command)}</code>"
    return f'<p class="opening" id="{where}">{how} <a href="#-">Close</a></p>'


def _html_blocks(section: Section, best: str | None) -> Iterator[str]:
    for block in section.blocks:
        if isinstance(block, TextTable):
            yield _html_table(block, best)
        elif isinstance(block, str | tuple):
            yield f'<p class="note">{_joined(block, _html_inline)}</p>'
    if pictures := [_html_picture(b) for b in section.blocks if isinstance(b, Picture)]:
        yield f'<div class="figures">{"".join(pictures)}</div>'
    if failures := [_html_failure(b) for b in section.blocks if isinstance(b, Failure)]:
        yield f'<div class="failures">{"".join(failures)}</div>'


def _html_table(table: TextTable, best: str | None) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in table.header)
    rows = ""
    for row in table.rows:
        mark = ' class="best"' if best is not None and best in row[:2] else ""
        rows += f"<tr{mark}>{''.join(map(_html_cell, row))}</tr>"
    body = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return f'<div class="scroll">{body}</div>{note}'


def _html_cell(cell: Cell) -> str:
    code = ' class="code"' if isinstance(cell, Link) and cell.kind == "code" else ""
    return f"<td{code}>{_joined(cell, _html_inline)}</td>"


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
    if failure.picture:
        image = f'<img alt="{title}: the pick that failed" src="{failure.picture}">'
    return f"<div>{_html_link(f'{image}<p><b>{title}</b></p>', failure.address)}<p>{escape(failure.text)}</p></div>"


def markdown_page(title: str, verdict: Verdict, sections: Sequence[Section], figures: str) -> str:
    """Return the report as Markdown, without links; `figures` is the directory of the pictures, relative to it."""
    lines = [f"# {QUESTION} {_plain(title)}", f"**{_plain(verdict.answer)}**"]
    lines += [_plain(reason) for reason in verdict.reasons]
    lines += [f"> {_plain(warning)}" for warning in verdict.warnings]
    for section in sections:
        lines += [f"## {_plain(section.title)}"] if section.title else []
        lines += [_markdown_block(block, figures) for block in section.blocks]
    return "\n\n".join(lines) + "\n"


def _markdown_block(block: Block, figures: str) -> str:
    if isinstance(block, TextTable):
        rows = [f"| {' | '.join(map(_plain, block.header))} |", "|---" * len(block.header) + "|"]
        rows += [f"| {' | '.join(_joined(c, _markdown_inline, ' ') for c in row)} |" for row in block.rows]
        return "\n".join(rows) + (f"\n\n{_plain(block.note)}" if block.note else "")
    if isinstance(block, Picture):
        title = _plain(block.title)
        return f"![{title}]({figures}/{block.name}.svg)\n\n*{title}.* {_plain(block.text)}"
    if isinstance(block, Failure):
        return f"- {_plain(block.title)}: {_plain(block.text)}."
    return _joined(block, _markdown_inline)


def _markdown_inline(cell: str | Link) -> str:
    if isinstance(cell, str):
        return _plain(cell)
    if cell.kind == "code":
        return f"`{cell.text}`"
    return f"*{_plain(cell.text)}*" if cell.kind == "drops" else _plain(cell.text)


def _joined(cell: Cell | Paragraph, inline: Callable[[str | Link], str], between: str = "") -> str:
    return between.join(map(inline, cell)) if isinstance(cell, tuple) else inline(cell)


def _plain(text: str) -> str:
    """Escape text so that Markdown shows it unchanged."""
    return _SPECIAL.sub(r"\\\1", re.sub(r"\s+", " ", text))
