"""A card per problem: a picture with four views, what is wanted, how difficult it is, and the oracle's order."""

import io
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from torc.generation.config import Hiddenness
from torc.generation.difficulty import Difficulty
from torc.generation.oracle_orders import OracleOrder
from torc.generation.views import ViewConfig, ViewName, problem_views
from torc.perception.label_places import LabelPlace, place_labels
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
_SUPERSAMPLING = 2
_INK, _FAINT, _PAPER, _LINE = (28, 30, 34), (98, 102, 110), (255, 255, 255), (222, 224, 228)
_RED: Color = object_color(TARGET_ID)
_DISC = 22
"""Diameter of a number's disc, pixels."""
_ROW = 34
"""Height of a row of the oracle's order, pixels."""
_QUALITIES = range(88, 39, -4)
_BOLD = 0.02
"""Width of the stroke of bold letters, of their size."""


@dataclass(frozen=True)
class Card:
    """What a card says of a problem; with the oracle's order, where it is known."""

    problem: Problem
    difficulty: Difficulty
    order: OracleOrder | None = None

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
    scale = _SUPERSAMPLING
    config = ViewConfig(width=scale * VIEW_SIZE[0], height=scale * VIEW_SIZE[1], outline_px=2 * scale)
    views = problem_views(card.problem, config=config)
    footer = _footer(card.order) if card.order else Image.new("RGB", (CARD_WIDTH, MARGIN), _PAPER)
    image = Image.new("RGB", (CARD_WIDTH, HEADER + VIEWS_SIZE[1] + footer.height), _PAPER)
    _draw_header(ImageDraw.Draw(image), card)
    for k, name in enumerate(VIEW_TITLES):
        corner = (MARGIN + k % 2 * (VIEW_SIZE[0] + GAP), HEADER + k // 2 * (VIEW_SIZE[1] + GAP))
        numbers = {} if name == "robot" else card.numbers
        image.paste(_picture(views[name], VIEW_TITLES[name], numbers), corner)
    image.paste(footer, (0, HEADER + VIEWS_SIZE[1]))
    return image


def jpeg_bytes(image: Image.Image, wanted_bytes: int) -> bytes:
    """A JPEG of at most that size, as good as that allows; a larger one if worse could not be read any more."""
    for quality in _QUALITIES:
        stream = io.BytesIO()
        image.save(stream, "JPEG", quality=quality, optimize=True, progressive=True)
        if stream.tell() <= wanted_bytes:
            break
    return stream.getvalue()


def _draw_header(draw: ImageDraw.ImageDraw, card: Card) -> None:
    problem, difficulty, right = card.problem, card.difficulty, float(CARD_WIDTH - MARGIN)
    for text, color in (
        (HIDDENNESS_WORDS[difficulty.hiddenness], (176, 82, 0)),
        (problem.category, (30, 90, 150)),
    ):
        right = _pill(draw, right, 20, text, color) - 8
    _write(draw, (MARGIN, 16), problem.name, 30, _INK, right - MARGIN, bold=True)
    start = MARGIN + _write(draw, (MARGIN, 55), "Wanted: ", 19, _FAINT, VIEWS_SIZE[0])
    wanted = problem.description or problem.target
    _write(draw, (start, 55), wanted, 19, _RED, CARD_WIDTH - MARGIN - start, bold=True)
    _write(draw, (MARGIN, 85), "  ·  ".join(facts(difficulty)), 16, _FAINT, VIEWS_SIZE[0])


def facts(difficulty: Difficulty) -> tuple[str, ...]:
    """The difficulty in a few words per fact."""
    return (
        f"{difficulty.objects} objects",
        f"{100 * difficulty.visible_fraction:.0f} % of the target in sight",
        f"{difficulty.in_front} in front of it",
        f"{difficulty.beside} beside",
        f"{difficulty.taller} taller",
    )


def _picture(view: View, title: str, numbers: Mapping[int, int]) -> Image.Image:
    """A view at its size on the card, with its title and the numbers of the objects to pick."""
    picture = Image.fromarray(view.rgb).resize(VIEW_SIZE, Image.Resampling.BOX)
    labels = np.ascontiguousarray(view.label_image[::_SUPERSAMPLING, ::_SUPERSAMPLING])
    sizes = dict.fromkeys(numbers, ((_DISC, _DISC), (_DISC, _DISC)))
    picture = picture.convert("RGBA")
    draw = ImageDraw.Draw(picture)
    places = place_labels(labels, sizes)
    for i, place in places.items():
        if place.leader:
            draw.line([_middle(place), place.anchor[::-1]], _RED if i == TARGET_ID else _INK, 2)
    for i, place in places.items():
        _disc(picture, _middle(place), numbers[i], i == TARGET_ID)
    tag = Image.new("RGBA", (int(_width(title, 15)) + 18, 25), (20, 22, 26, 165))
    ImageDraw.Draw(tag).text((9, 3), title, (255, 255, 255), ImageFont.load_default(15))
    picture.alpha_composite(tag, (0, 0))
    return picture.convert("RGB")


def _footer(order: OracleOrder) -> Image.Image:
    """The oracle's order, in as many rows as it takes."""
    image = Image.new("RGB", (CARD_WIDTH, 44 + _ROW * (len(order.names) + 1)), _PAPER)
    draw = ImageDraw.Draw(image)
    start = MARGIN + _write(draw, (MARGIN, 14), "ORACLE: ", 16, _INK, VIEWS_SIZE[0], bold=True)
    _write(draw, (start, 14), order.verdict, 16, _FAINT, CARD_WIDTH - MARGIN - start)
    x, y = float(MARGIN), 44
    for number, name in enumerate(order.names, start=1):
        is_last = number == len(order.names)
        width = _DISC + 7 + _width(name, 16)
        if x > MARGIN and x + width > CARD_WIDTH - MARGIN:
            x, y = float(MARGIN), y + _ROW
        _disc(image, (x + _DISC / 2, y + _DISC / 2), number, is_last)
        _write(draw, (x + _DISC + 7, y + 1), name, 16, _INK, CARD_WIDTH - MARGIN - x - _DISC - 7)
        x += width + 24
    return image.crop((0, 0, CARD_WIDTH, y + _ROW + 4 if order.names else 48))


def _pill(draw: ImageDraw.ImageDraw, right: float, y: int, text: str, color: Color) -> float:
    """A rounded label that ends there; returns where it begins."""
    left = right - _width(text, 16) - 24
    draw.rounded_rectangle((left, y, right, y + 28), 14, outline=color, width=2)
    draw.text((left + 12, y + 4), text, color, ImageFont.load_default(16))
    return left


def _disc(image: Image.Image, middle: tuple[float, float], number: int, is_target: bool) -> None:
    """A number in a disc, smooth at its rim."""
    large = 4 * _DISC
    mask = Image.new("L", (large, large))
    ImageDraw.Draw(mask).ellipse((0, 0, large - 1, large - 1), 255)
    disc = Image.new("RGB", (large, large), (255, 255, 255))
    ImageDraw.Draw(disc).ellipse((5, 5, large - 6, large - 6), _RED if is_target else _INK)
    corner = (round(middle[0] - _DISC / 2), round(middle[1] - _DISC / 2))
    image.paste(disc.reduce(4), corner, mask.reduce(4))
    font = ImageFont.load_default(14 if number < 10 else 12)
    centre = (corner[0] + _DISC / 2, corner[1] + _DISC / 2)
    ImageDraw.Draw(image).text(centre, str(number), (255, 255, 255), font, anchor="mm", stroke_width=0.4)


def _middle(place: LabelPlace) -> tuple[float, float]:
    return place.col + place.size[1] / 2, place.row + place.size[0] / 2


def _write(
    draw: ImageDraw.ImageDraw,
    at: tuple[float, float],
    text: str,
    size: int,
    color: Color,
    room: float,
    bold: bool = False,
) -> float:
    """Text that begins there, smaller or cut off where there is little room; returns its width."""
    text, small = _drawable(text), size
    while _width(text, small, bold) > room and small > 0.7 * size:
        small -= 1
    while _width(text, small, bold) > room and len(text) > 1:
        text = text.rstrip("…")[:-1] + "…"
    x, y = at
    font = ImageFont.load_default(small)
    draw.text((x, y + size - small), text, color, font, stroke_width=_BOLD * small * bold)
    return _width(text, small, bold)


def _width(text: str, size: int, bold: bool = False) -> float:
    return ImageFont.load_default(size).getlength(_drawable(text)) + 2 * _BOLD * size * bold


def _drawable(text: str) -> str:
    """Pillow's own font has few letters beyond ASCII: accents are left out, what is left becomes a question mark."""
    plain = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    return "".join(c if c.isascii() or c in "·…" else "?" for c in plain).replace("\n", " ")
