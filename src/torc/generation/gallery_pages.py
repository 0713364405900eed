"""The pages of a gallery of problems: Markdown, as code hosts show it, and HTML that needs nothing but its folder."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template

from torc.generation.cards import (
    CARD_WIDTH,
    GAP,
    HEADER,
    HIDDENNESS_WORDS,
    MARGIN,
    VIEW_SIZE,
    VIEWS_SIZE,
    Card,
    facts,
)

_TEMPLATE = Path(__file__).with_name("gallery.html")
_INTRO = (
    "Each problem as the robot's camera sees it, and from the front, the side and the top. The target is outlined: "
    "solid where it is in sight, dashed where something hides it."
)
_NUMBERS = "Numbers are the picks of the best order that ORACLE found."


@dataclass(frozen=True)
class Shown:
    """A card that has been drawn: what it says, its picture (from the pages' folder), and that one's height, pixels."""

    card: Card
    file: str
    height: int


def markdown_page(title: str, shown: Sequence[Shown]) -> str:
    """A table of the problems, then the cards by category."""
    lines = [f"# {_plain(title)}", "", _intro(shown), ""]
    columns = ["problem", "wanted", "objects", "in sight", *(["ORACLE"] if _any_order(shown) else [])]
    lines += [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    lines += [f"| {' | '.join(_cells(s.card)[: len(columns)])} |" for s in shown]
    for category in dict.fromkeys(s.card.problem.category for s in shown):
        lines += ["", f"## {category.capitalize()}"]
        for s in shown:
            if s.card.problem.category == category:
                lines += ["", f"### {s.card.problem.name}", "", f"![{_plain(_alt(s.card))}]({s.file})"]
    return "\n".join(lines) + "\n"


def html_page(title: str, shown: Sequence[Shown]) -> str:
    """A page that filters its cards by category and by how much of the target is in sight."""
    width, height = VIEWS_SIZE
    categories = [(s.card.problem.category, s.card.problem.category) for s in shown]
    seen = {s.card.difficulty.hiddenness for s in shown}
    groups = [(group.value, words) for group, words in HIDDENNESS_WORDS.items() if group in seen]
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(title),
        intro=escape(_intro(shown)),
        views_width=width,
        views_height=height,
        image_width=_percent(CARD_WIDTH, width),
        image_left=_percent(-MARGIN, width),
        image_top=_percent(-HEADER, height),
        gap_left=_percent(VIEW_SIZE[0], width),
        gap_width=_percent(GAP, width),
        gap_top=_percent(VIEW_SIZE[1], height),
        gap_height=_percent(GAP, height),
        filters="\n".join(
            [_filter("category", "Category", categories), _filter("hiddenness", "Target", groups)]
        ),
        cards="\n".join(map(_article, shown)),
    )


def _intro(shown: Sequence[Shown]) -> str:
    return f"{_INTRO} {_NUMBERS}" if _any_order(shown) else _INTRO


def _any_order(shown: Iterable[Shown]) -> bool:
    return any(s.card.order for s in shown)


def _cells(card: Card) -> list[str]:
    """Of the table's row."""
    name, order = card.problem.name, card.order
    # A code host's anchor: the heading in small letters, without its dots.
    anchor = re.sub(r"[^a-z0-9_-]", "", name.lower())
    seen = f"{100 * card.difficulty.visible_fraction:.0f} %"
    picks = f"{len(order.names)} picks" if order and order.names else ""
    return [f"[{name}](#{anchor})", _plain(_wanted(card)), str(card.difficulty.objects), seen, picks]


def _article(shown: Shown) -> str:
    card, file = shown.card, escape(shown.file)
    name, group = escape(card.problem.name), card.difficulty.hiddenness
    category = escape(card.problem.category)
    lines = [
        f'<article id="{name}" data-category="{category}" data-hiddenness="{group.value}">',
        f'<a class="views" href="{file}"><img src="{file}" width="{CARD_WIDTH}" height="{shown.height}" '
        f'loading="lazy" alt="{escape(_alt(card))}"></a>',
        '<div class="words">',
        f'<div class="head"><h2><a href="#{name}">{name}</a></h2>'
        f'<div class="tags"><span class="category">{category}</span>'
        f'<span class="hiddenness">{HIDDENNESS_WORDS[group]}</span></div></div>',
        f'<p class="wanted">Wanted: <strong>{escape(_wanted(card))}</strong></p>',
        f'<p class="facts">{" · ".join(facts(card.difficulty))}</p>',
    ]
    if card.order:
        lines.append(f'<p class="verdict"><strong>ORACLE:</strong> {escape(card.order.verdict)}</p>')
        if card.order.names:
            lines.append("<ol>" + "".join(f"<li>{escape(n)}</li>" for n in card.order.names) + "</ol>")
    return "\n".join([*lines, "</div>", "</article>"])


def _filter(fact: str, title: str, values: Iterable[tuple[str, str]]) -> str:
    """A row of choices, of which one is chosen."""
    choices = [("", "all"), *dict.fromkeys(values)]
    labels = [
        f'<label><input type="radio" name="{fact}" value="{value}"{"" if value else " checked"}>'
        f"<span>{text}</span></label>"
        for value, text in choices
    ]
    return f"<fieldset><legend>{title}</legend>{''.join(labels)}</fieldset>"


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole:.4f}%"


def _wanted(card: Card) -> str:
    return card.problem.description or card.problem.target


def _alt(card: Card) -> str:
    """The card in a sentence, for those who do not see it."""
    order = f"; ORACLE: {', '.join(card.order.names)}" if card.order and card.order.names else ""
    what = f"{card.problem.name}, {card.problem.category}, wanted: {_wanted(card)}"
    return f"{what}; {', '.join(facts(card.difficulty))}{order}"


def _plain(text: str) -> str:
    """Text that Markdown takes as it is."""
    return re.sub(r"([\\`*\[\]<>|#$~])", r"\\\1", " ".join(text.split()))
