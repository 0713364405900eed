"""A card per problem: a picture with four views, what is wanted, how difficult it is, and the oracle's order."""

import io
import unicodedata
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from torc.generation.config import Hiddenness
from torc.generation.difficulty import Difficulty
from torc.generation.oracle_orders import OracleOrder
from torc.generation.views import ViewConfig, ViewName, problem_views
from torc.perception.label_places import place_labels
from torc.perception.palette import object_color
from torc.problems.problem import Problem
from torc.records import TARGET_ID
from torc.sim.rendering import View

Color = tuple[int, int, int]
VIEW_SIZE = (476, 357)
GAP, MARGIN, HEADER = 8, 20, 116
"""Between the four views, around the card, above the views; pixels."""
VIEWS_SIZE = (2 * VIEW_SIZE[0] + GAP, 2 * VIEW_SIZE[1] + GAP)
CARD_WIDTH = VIEWS_SIZE[0] + 2 * MARGIN
VIEW_TITLES: dict[ViewName, str] = {
    "robot": "what the robot sees",
    "front": "front",
    "side": "side",
    "top": "top",
}
HIDDENNESS_WORDS = {
    Hiddenness.VISIBLE: "in sight",
    Hiddenness.PARTLY: "partly in sight",
    Hiddenness.HIDDEN: "hidden",
}
_SCALE = 2
"""Views are drawn that much larger, for smooth edges."""
_INK, _FAINT, _PAPER = (28, 30, 34), (98, 102, 110), (255, 255, 255)
_RED: Color = object_color(TARGET_ID)
_DISC = 22
"""Diameter of a number's disc, pixels."""
_LINE = 24
"""Height of a line of the oracle's order, pixels."""
_QUALITIES = range(88, 39, -4)


@dataclass(frozen=True)
class Card:
    """What a card says of a problem; with the oracle's order, where it is known."""

    problem: Problem
    difficulty: Difficulty
    order: OracleOrder | None = None

    @property
    def wanted(self) -> str:
        """The target in words."""
        return self.problem.description or self.problem.target

    @property
    def numbers(self) -> dict[int, int]:
        """When each object is first picked, from 1 on, by its id, as far as the order has it."""
        names = self.order.names if self.order else ()
        ids = enumerate(self.problem.ordered())
        return {i: names.index(o.name) + 1 for i, o in ids if o.name in names}

    def to_dict(self) -> dict[str, Any]:
        """As JSON-compatible data."""
        return {
            "problem": self.problem.name,
            "category": self.problem.category,
            "description": self.problem.description,
            "objects": self.difficulty.objects,
            **self.difficulty.facts(),
            "order": list(self.order.names) if self.order else None,
            "verdict": self.order.verdict if self.order else None,
        }


def draw_card(card: Card) -> Image.Image:
    """The card, CARD_WIDTH pixels wide: a header, four views below it, and the oracle's order where it is known.

    The objects of that order carry their numbers in the views from the front, the side and the top.
    """
    config = ViewConfig(_SCALE * VIEW_SIZE[0], _SCALE * VIEW_SIZE[1], outline_px=2 * _SCALE)
    views = problem_views(card.problem, config=config)
    below = _order_lines(card.order) if card.order else []
    bottom = HEADER + VIEWS_SIZE[1]
    image = Image.new("RGB", (CARD_WIDTH, bottom + MARGIN + _LINE * len(below)), _PAPER)
    draw = ImageDraw.Draw(image)
    problem = card.problem
    told = (problem.category, HIDDENNESS_WORDS[card.difficulty.hiddenness], *facts(card.difficulty))
    for y, text, size, color in (
        (16, problem.name, 30, _INK),
        (55, f"Wanted: {card.wanted}", 19, _RED),
        (85, "  ·  ".join(told), 16, _FAINT),
        *((bottom + 10 + _LINE * k, line, 16, _INK) for k, line in enumerate(below)),
    ):
        draw.text((MARGIN, y), _cut(text, size), color, ImageFont.load_default(size))
    for k, name in enumerate(VIEW_TITLES):
        corner = (MARGIN + k % 2 * (VIEW_SIZE[0] + GAP), HEADER + k // 2 * (VIEW_SIZE[1] + GAP))
        numbers = {} if name == "robot" else card.numbers
        image.paste(_picture(views[name], VIEW_TITLES[name], numbers), corner)
    return image


def jpeg_bytes(image: Image.Image, wanted_bytes: int) -> bytes:
    """A JPEG of at most that size, as good as that allows; a larger one if worse could not be read any more."""
    for quality in _QUALITIES:
        stream = io.BytesIO()
        image.save(stream, "JPEG", quality=quality, optimize=True, progressive=True)
        if stream.tell() <= wanted_bytes:
            break
    return stream.getvalue()


def facts(difficulty: Difficulty) -> tuple[str, ...]:
    """The difficulty in a few words per fact."""
    return (
        f"{difficulty.objects} objects",
        f"{100 * difficulty.visible_fraction:.0f} % of the target in sight",
        f"{difficulty.in_front} in front of it",
        f"{difficulty.beside} beside",
        f"{difficulty.taller} taller",
    )


def _picture(view: View, title: str, numbers: dict[int, int]) -> Image.Image:
    """A view at its size on the card, with its title and the numbers of the objects to pick."""
    picture = Image.fromarray(view.rgb)
    draw = ImageDraw.Draw(picture)
    size = _SCALE * _DISC
    places = place_labels(np.ascontiguousarray(view.label_image), dict.fromkeys(numbers, ((size, size),) * 2))
    for i, place in places.items():
        color = _RED if i == TARGET_ID else _INK
        x, y = place.col + size / 2, place.row + size / 2
        if place.leader:
            draw.line([(x, y), place.anchor[::-1]], color, 2 * _SCALE)
        draw.circle((x, y), size / 2, color, _PAPER, _SCALE)
        draw.text((x, y), str(numbers[i]), _PAPER, ImageFont.load_default(13 * _SCALE), anchor="mm")
    font = ImageFont.load_default(15 * _SCALE)
    draw.rectangle((0, 0, font.getlength(title) + 18 * _SCALE, 25 * _SCALE), (20, 22, 26))
    draw.text((9 * _SCALE, 3 * _SCALE), title, _PAPER, font)
    return picture.resize(VIEW_SIZE, Image.Resampling.BOX)


def _order_lines(order: OracleOrder) -> list[str]:
    """The oracle's verdict, and its order in as many lines as it takes."""
    lines = [f"ORACLE: {order.verdict}"]
    for number, name in enumerate(order.names, start=1):
        pick, font = f"{number} {name}", ImageFont.load_default(16)
        if number > 1 and font.getlength(f"{lines[-1]}   {pick}") < VIEWS_SIZE[0]:
            lines[-1] = f"{lines[-1]}   {pick}"
        else:
            lines.append(pick)
    return lines


def _cut(text: str, size: int) -> str:
    """Text as wide as the card at most, in letters that Pillow's own font has: few beyond ASCII."""
    plain = "".join(c for c in unicodedata.normalize("NFKD", text) if c.isascii() or c == "·").replace(
        "\n", " "
    )
    font = ImageFont.load_default(size)
    while font.getlength(plain) > VIEWS_SIZE[0]:
        plain = plain[: -4 if plain.endswith("...") else -1].rstrip() + "..."
    return plain
