"""A gallery of problems: their cards as pictures in a folder, and the pages that show them."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from torc.errors import InputError
from torc.generation.cards import Card, draw_card, jpeg_bytes
from torc.generation.difficulty import difficulty_of
from torc.generation.gallery_pages import Shown, html_page, markdown_page
from torc.generation.inspection import Inspector
from torc.generation.oracle_orders import OracleOrder, stated_order
from torc.problems.problem import Problem

MAX_CARD_BYTES = 70_000
CARDS, HTML, MARKDOWN = "cards", "index.html", "gallery.md"
"""Names in the folder of a gallery."""


def make_gallery(
    title: str,
    problems: Sequence[Problem],
    inspector: Inspector,
    out: Path,
    orders: Mapping[str, OracleOrder],
    progress: Callable[[Problem], None] = lambda _: None,
) -> list[Card]:
    """Draws a card per problem into `out/cards`, then writes the pages.

    Args:
        title: of the pages.
        problems: in the order of the pages; no two of one name.
        inspector: measures the difficulty where a problem does not state it.
        out: folder of the pages; files of these names are replaced, others stay.
        orders: the oracle's, by the problem's name; where missing, the one that the problem states.
        progress: told of each problem before its card is drawn.

    Raises:
        InputError: two problems of one name, or `out` cannot be written.
    """
    twice = [name for name, count in Counter(problem.name for problem in problems).items() if count > 1]
    if twice:
        raise InputError(
            f"Several problems have the same name: {', '.join(twice)}. Choose others, or rename them in their files."
        )
    shown = []
    try:
        (out / CARDS).mkdir(parents=True, exist_ok=True)
        for problem in problems:
            progress(problem)
            order = orders.get(problem.name) or stated_order(problem)
            card = Card(problem, difficulty_of(problem, inspector), order)
            image, file = draw_card(card), f"{CARDS}/{problem.name}.jpg"
            (out / file).write_bytes(jpeg_bytes(image, MAX_CARD_BYTES))
            shown.append(Shown(card, file, image.height))
        (out / MARKDOWN).write_text(markdown_page(title, shown), encoding="utf-8")
        (out / HTML).write_text(html_page(title, shown), encoding="utf-8")
    except OSError as error:
        raise InputError(f"'{out}' cannot be written ({error.strerror}). Choose another --out.") from error
    return [s.card for s in shown]


def left_over(problems: Iterable[Problem], out: Path) -> tuple[str, ...]:
    """Names of the cards in a gallery's folder that belong to none of the problems."""
    names = {problem.name for problem in problems}
    return tuple(sorted(p.name for p in (out / CARDS).glob("*.jpg") if p.stem not in names))
