"""A card per problem: four views in one picture, the target, the difficulty, and the oracle's order."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from torc.drawing.label_places import place_labels
from torc.drawing.palette import object_color
from torc.generation.config import Hiddenness
from torc.generation.inspection import Difficulty
from torc.generation.oracle_orders import OracleOrder
from torc.generation.views import ViewConfig, problem_views
from torc.problems.problem import Problem
from torc.records import TARGET_ID
from torc.sim.rendering import View

VIEW_SIZE, GAP = (476, 357), 8
"""Size of the four views on a card, and the gap between them; pixels."""
HIDDENNESS_WORDS = {
    Hiddenness.VISIBLE: "in sight",
    Hiddenness.PARTLY: "partly in sight",
    Hiddenness.HIDDEN: "hidden",
}
_SCALE = 2
"""Views are drawn this much larger, for smooth edges."""
_DISC = 22 * _SCALE
"""Diameter of a number's disc, pixels."""
_INK, _PAPER = (28, 30, 34), (255, 255, 255)


@dataclass(frozen=True)
class Card:
    """The content of a problem's card; with the oracle's order, if it is known."""

    problem: Problem
    difficulty: Difficulty
    order: OracleOrder | None = None

    @property
    def wanted(self) -> str:
        """The target as text."""
        return self.problem.description or self.problem.target

    @property
    def facts(self) -> str:
        """Category and difficulty as text."""
        d = self.difficulty
        if self.problem.absent:
            return f"{self.problem.category}, {d.objects} objects; the target is not there"
        return (
            f"{self.problem.category}, {d.objects} objects, {100 * d.visible_fraction:.0f} % of the target in sight, "
            f"{d.in_front} in front of it, {d.beside} beside, {d.taller} taller"
        )

    @property
    def picks(self) -> str:
        """The oracle's verdict and its order as text; empty if there is none."""
        if self.order is None:
            return ""
        numbered = ", ".join(f"{k} {name}" for k, name in enumerate(self.order.names, start=1))
        return f"ORACLE: {self.order.verdict} {numbered}".strip()

    @property
    def numbers(self) -> dict[int, int]:
        """The number of the pick, from 1, in which each object of the order is first picked, by its id."""
        names = self.order.names if self.order else ()
        ids = enumerate(self.problem.ordered())
        return {i: names.index(o.name) + 1 for i, o in ids if o.name in names}

    def to_dict(self) -> dict[str, Any]:
        """Return JSON-compatible data."""
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
    """Draw the robot's view, and the problem from the front, the side and the top, with the numbers of the oracle's
    order.
    """
    config = ViewConfig(_SCALE * VIEW_SIZE[0], _SCALE * VIEW_SIZE[1], outline_px=2 * _SCALE)
    image = Image.new("RGB", (2 * VIEW_SIZE[0] + GAP, 2 * VIEW_SIZE[1] + GAP), _PAPER)
    for k, (name, view) in enumerate(problem_views(card.problem, config=config).items()):
        picture = _numbered(view, {} if name == "robot" else card.numbers)
        title = "what the robot sees" if name == "robot" else name
        ImageDraw.Draw(picture).text((20, 12), title, _INK, ImageFont.load_default(15 * _SCALE))
        corner = (k % 2 * (VIEW_SIZE[0] + GAP), k // 2 * (VIEW_SIZE[1] + GAP))
        image.paste(picture.resize(VIEW_SIZE, Image.Resampling.BOX), corner)
    return image


def _numbered(view: View, numbers: dict[int, int]) -> Image.Image:
    """Write numbers on or beside some objects of a view."""
    picture = Image.fromarray(view.rgb)
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(13 * _SCALE)
    discs = dict.fromkeys(numbers, ((_DISC, _DISC),) * 2)
    places = place_labels(np.ascontiguousarray(view.label_image), discs)
    for i, place in places.items():
        color = object_color(TARGET_ID) if i == TARGET_ID else _INK
        x, y = place.col + _DISC / 2, place.row + _DISC / 2
        if place.leader:
            draw.line([(x, y), place.anchor[::-1]], color, 2 * _SCALE)
        draw.circle((x, y), _DISC / 2, color, _PAPER, _SCALE)
        draw.text((x, y), str(numbers[i]), _PAPER, font, anchor="mm")
    return picture
