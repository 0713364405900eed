"""`torc objects sheet`: pictures of objects, with name, description, size and mass."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from torc.cli.known_objects import known_objects, pass_over

if TYPE_CHECKING:  # the command line answers before Pillow and MuJoCo are imported
    from PIL.Image import Image as Picture
    from PIL.ImageDraw import ImageDraw

    from torc.objects.models import ObjectModel

COLUMNS, ROWS = 5, 8
CELL, CAPTION = (250, 205), 68
_INK, _FAINT, _PAPER = (30, 30, 30), (105, 105, 105), (252, 252, 250)


@dataclass(frozen=True)
class SheetCommand:
    """Draw a contact sheet: every object as the simulator shows it, with its size and mass."""

    names: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="[NAME...]")] = ()
    """Objects or kinds to draw, your own too; all if none are named. What is damaged is passed over."""
    out: Annotated[
        Path, tyro.conf.arg(metavar="FILE", help="A .jpg or .png; several pages become NAME-1, NAME-2 ...")
    ] = Path("objects.jpg")

    def run(self) -> int:
        """Draw and save the pages."""
        from rich.console import Console

        from torc.errors import InputError

        names = _chosen(self.names)
        _prepare(self.out)
        with Console(stderr=True).status("") as status:
            cells = list(_cells(names, status.update))
        if not cells:
            raise InputError("None of these objects can be drawn. Import them again, or name others.")
        count = -(-len(cells) // (COLUMNS * ROWS))
        for number, page in enumerate(contact_sheets(cells), start=1):
            path = self.out if count == 1 else self.out.with_stem(f"{self.out.stem}-{number}")
            _save(page, path)
            print(f"{path}  (page {number} of {count})", flush=True)
        return 0


def _chosen(names: Sequence[str]) -> list[str]:
    """Model names of the objects and kinds named, without those that cannot be read."""
    from torc.errors import UnknownNameError
    from torc.objects.library import object_names

    known = known_objects()
    sound, kinds = [facts.name for facts in known], list(dict.fromkeys(facts.kind for facts in known))
    chosen: list[str] = []
    for name in names:
        if name in kinds:
            chosen += [facts.name for facts in known if facts.kind == name]
        elif name in sound:
            chosen.append(name)
        elif name not in object_names():
            raise UnknownNameError("object or kind", name, [*sound, *kinds])
    return list(dict.fromkeys(chosen)) if names else sound


def check_picture_name(path: Path, *endings: str) -> None:
    """Raises InputError unless a picture's name has one of the endings; .jpeg counts as .jpg."""
    from torc.errors import InputError

    if path.suffix.lower().replace(".jpeg", ".jpg") not in endings:
        raise InputError(f"{path}: pictures are written as {' or '.join(endings)}. Use a name that ends so.")


def _prepare(path: Path) -> None:
    """Finds out that the pages cannot be written before time is spent on drawing them."""
    check_picture_name(path, ".jpg", ".png")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritable(path, error) from error


def _save(page: "Picture", path: Path) -> None:
    try:
        page.save(path, quality=82, optimize=True)
    except OSError as error:
        raise _unwritable(path, error) from error


def _unwritable(path: Path, error: OSError) -> Exception:
    from torc.errors import InputError

    return InputError(f"{path} cannot be written ({error.strerror}). Choose another --out.")


def _cells(names: Sequence[str], say: Callable[[str], None]) -> Iterator["Picture"]:
    """Portraits with captions of the objects that can be drawn; `say` is told which comes next."""
    from torc.errors import InputError
    from torc.objects.library import load_object

    for number, name in enumerate(names, start=1):
        say(f"{number} of {len(names)}: {name}")
        try:
            yield _cell(load_object(name))
        except InputError as error:
            pass_over(error)


def _cell(model: "ObjectModel") -> "Picture":
    from PIL import Image, ImageDraw

    from torc.sim.portraits import portrait

    cell = Image.new("RGB", (CELL[0], CELL[1] + CAPTION), _PAPER)
    cell.paste(Image.fromarray(portrait(model, *CELL)), (0, 0))
    _caption(ImageDraw.Draw(cell), 8, CELL[1] + 4, model)
    return cell


def contact_sheets(cells: Sequence["Picture"]) -> Iterator["Picture"]:
    """Pages of portraits with captions, in the given order."""
    from PIL import Image

    width, height = CELL[0], CELL[1] + CAPTION
    for first in range(0, len(cells), COLUMNS * ROWS):
        some = cells[first : first + COLUMNS * ROWS]
        page = Image.new("RGB", (COLUMNS * width, -(-len(some) // COLUMNS) * height), _PAPER)
        for k, cell in enumerate(some):
            page.paste(cell, (k % COLUMNS * width, k // COLUMNS * height))
        yield page


def _caption(draw: "ImageDraw", x: int, y: int, model: "ObjectModel") -> None:
    """Name, description, size (depth, width, height) and mass below a portrait."""
    from PIL import ImageFont

    edges = " x ".join(f"{1000 * s:.0f}" for s in model.size_m)
    facts = f"{edges} mm, {1000 * model.mass_kg:.0f} g"
    for text, size, color in ((model.name, 17, _INK), (model.description, 14, _FAINT), (facts, 14, _FAINT)):
        shrunk = size
        while draw.textlength(text, font=ImageFont.load_default(shrunk)) > CELL[0] - 14 and shrunk > 8:
            shrunk -= 1
        draw.text((x, y), text, color, ImageFont.load_default(shrunk))
        y += size + 5
