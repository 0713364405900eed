"""A gallery of problems: their cards in a folder, and two pages that show them: Markdown for code hosts, and HTML that
needs nothing but its folder.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template

from torc.errors import InputError
from torc.generation.cards import HIDDENNESS_WORDS, Card, draw_card
from torc.generation.inspection import Inspector, difficulty_of
from torc.oracle.answer import OracleOrder, stated_order
from torc.problems.problem import Problem

CARDS, HTML, MARKDOWN = "cards", "index.html", "gallery.md"
"""Names in the folder of a gallery."""
_TEMPLATE = Path(__file__).with_name("gallery.html")
_INTRO = (
    "Each problem as the robot's camera sees it, and from the front, the side and the top. The target is outlined: "
    "solid where it is in sight, dashed where something hides it. Numbers are the picks of the best order that ORACLE "
    "found."
)


def make_gallery(
    title: str,
    problems: Sequence[Problem],
    inspector: Callable[[Problem], Inspector],
    out: Path,
    orders: Mapping[str, OracleOrder],
    progress: Callable[[Problem], None] = lambda _: None,
) -> list[Card]:
    """Draw a card per problem into `out/cards`, then write the pages; files of these names are replaced.

    `orders` are by the problem's name; others are taken from the problem itself, if it states one. `progress` is called
    with each problem first. Raises InputError if two problems have one name, or `out` cannot be written.
    """
    twice = [name for name, count in Counter(problem.name for problem in problems).items() if count > 1]
    if twice:
        raise InputError(
            f"Several problems have the same name: {', '.join(twice)}. Choose others, or rename them in their files."
        )
    cards = []
    try:
        (out / CARDS).mkdir(parents=True, exist_ok=True)
        for problem in problems:
            progress(problem)
            order = orders.get(problem.name) or stated_order(problem)
            cards.append(Card(problem, difficulty_of(problem, inspector(problem)), order))
            draw_card(cards[-1]).save(out / _file(cards[-1]), quality=72, optimize=True)
        (out / MARKDOWN).write_text(_markdown_page(title, cards), encoding="utf-8")
        (out / HTML).write_text(_html_page(title, cards), encoding="utf-8")
    except OSError as error:
        raise InputError(f"'{out}' cannot be written ({error.strerror}). Choose another --out.") from error
    return cards


def _markdown_page(title: str, cards: Sequence[Card]) -> str:
    """Return a table of the problems, then the cards by category."""
    lines = [f"# {_plain(title)}", "", _INTRO, ""]
    lines += ["| problem | wanted | objects | in sight | ORACLE |", "|---|---|---|---|---|"]
    for card in cards:
        name, difficulty = card.problem.name, card.difficulty
        # A code host's anchor: the heading in small letters, without its dots.
        anchor = re.sub(r"[^a-z0-9_-]", "", name.lower())
        picks = f"{len(card.order.names)} picks" if card.order and card.order.names else ""
        seen = f"{100 * difficulty.visible_fraction:.0f} %"
        cells = [f"[{name}](#{anchor})", _plain(card.wanted), str(difficulty.objects), seen, picks]
        lines.append(f"| {' | '.join(cells)} |")
    for category in dict.fromkeys(card.problem.category for card in cards):
        lines += ["", f"## {category.capitalize()}"]
        for card in cards:
            if card.problem.category == category:
                told = filter(None, (f"Wanted: {card.wanted}", card.facts, card.picks))
                lines += ["", f"### {card.problem.name}", "", *(f"- {_plain(text)}" for text in told), ""]
                lines.append(f"![{card.problem.name}]({_file(card)})")
    return "\n".join(lines) + "\n"


def _html_page(title: str, cards: Sequence[Card]) -> str:
    """Return a page that filters its cards by category and by how much of the target is in sight."""
    seen = {card.difficulty.hiddenness for card in cards}
    categories: dict[str, str] = {card.problem.category: card.problem.category for card in cards}
    groups = {group.value: words for group, words in HIDDENNESS_WORDS.items() if group in seen}
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(title),
        intro=escape(_INTRO),
        filters=_filter("category", categories) + "\n" + _filter("hiddenness", groups),
        cards="\n".join(map(_article, cards)),
    )


def _article(card: Card) -> str:
    name, file = escape(card.problem.name), escape(_file(card))
    return (
        f'<article id="{name}" data-category="{escape(card.problem.category)}" '
        f'data-hiddenness="{card.difficulty.hiddenness.value}">'
        f"<h2>{name}</h2><p><strong>Wanted: {escape(card.wanted)}</strong><br>{escape(card.facts)}</p>"
        f'<a href="{file}"><img src="{file}" loading="lazy" alt=""></a><p>{escape(card.picks)}</p></article>'
    )


def _filter(fact: str, values: Mapping[str, str]) -> str:
    options = "".join(f'<option value="{value}">{text}</option>' for value, text in values.items())
    return f'<label>{fact} <select name="{fact}"><option value="">all</option>{options}</select></label>'


def _file(card: Card) -> str:
    return f"{CARDS}/{card.problem.name}.jpg"


def _plain(text: str) -> str:
    """Escape text for Markdown."""
    return re.sub(r"([\\`*\[\]<>|#$~])", r"\\\1", " ".join(text.split()))
