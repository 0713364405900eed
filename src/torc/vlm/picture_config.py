"""How a scene is shown to a model: the settings, and what a prompt says about them."""

from dataclasses import dataclass
from typing import Literal, get_args

from torc.errors import InputError

Marks = Literal["tinted", "outlines", "clear"]
MARKS: tuple[str, ...] = get_args(Marks)
_BESIDE = "white on a black square, on it or beside it with a line to it."
_OWN = "Within the outlines the colours are the objects' own."
_DRAWN = {
    "tinted": "tinted and outlined in a colour of its own, and carries its number in white on a black square near its "
    "centre of mass.",
    "clear": "outlined in a colour that its neighbours do not have, and has its number in "
    f"{_BESIDE} Where an object shows in several pieces, a dotted line in its colour joins them. {_OWN}",
    "outlines": f"outlined in a colour of its own, and has its number in {_BESIDE} {_OWN}",
}
"""What a prompt says about each kind of marks."""
_MIN_SIDE_PX, _MAX_SIDE_PX = 64, 4096
_MAX_MARGIN_PX = 4096


@dataclass(frozen=True)
class PictureConfig:
    """How a scene is shown to a model.

    Attributes:
        marks: "tinted": every object tinted in its own colour, as in the paper; "outlines": thin outlines and small
            numbers, every other pixel unchanged; "clear": outlines drawn for the question (`torc.drawing.clear_marks`):
            cut to the objects, at least 1024 pixels across them unless crop_px and longest_side_px say otherwise.
        plain: send the picture without marks as a second one.
        crop_px: margin around the visible objects, pixels of the camera's image; None sends the whole image.
        longest_side_px: enlarge (or reduce) the picture to this longest side before it is marked; None leaves it.
    """

    marks: Marks = "tinted"
    plain: bool = False
    crop_px: int | None = None
    longest_side_px: int | None = None

    def __post_init__(self) -> None:
        if self.marks not in MARKS:
            raise InputError(f"Marks '{self.marks}' are none; there are {', '.join(MARKS)}.")
        if self.crop_px is not None and not 0 <= self.crop_px <= _MAX_MARGIN_PX:
            raise InputError(
                f"The margin around the objects is {self.crop_px} pixels; it must be at least 0."
            )
        side = self.longest_side_px
        if side is not None and not _MIN_SIDE_PX <= side <= _MAX_SIDE_PX:
            raise InputError(
                f"The picture's longest side is {side} pixels; it must be {_MIN_SIDE_PX} to {_MAX_SIDE_PX}."
            )

    @property
    def words(self) -> tuple[str, ...]:
        """How the settings differ from the paper's picture, for labels."""
        return (
            *((self.marks,) if self.marks != "tinted" else ()),
            *(("plain beside",) if self.plain else ()),
            *(() if self.crop_px is None else (f"crop {self.crop_px}",)),
            *(() if self.longest_side_px is None else (f"{self.longest_side_px} px",)),
        )

    @property
    def sentences(self) -> str:
        """The sentences that describe the pictures in a prompt; for the paper's picture, those of the first prompts."""
        picture = "The first picture" if self.plain else "The picture"
        cut = self.crop_px is not None or self.marks == "clear"
        end = ", cut to the part with the objects." if cut else "."
        second = " The second is the same picture without these marks: judge colours and shapes by it."
        said = (
            f"{picture} is what the camera of a robot arm sees{end} Each object in it is {_DRAWN[self.marks]}"
        )
        return said + (second if self.plain else "")
