"""`torc objects sheet`: pictures of objects, with name, description, size and mass."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from torc.cli.printing import tell
from torc.errors import InputError, UnknownNameError

if TYPE_CHECKING:  # the command line answers before Pillow and MuJoCo are imported
    from PIL.Image import Image as Picture

    from torc.objects.library import ObjectFacts
    from torc.objects.models import ObjectModel

COLUMNS, ROWS = 5, 8
CELL, CAPTION = (250, 205), 68
_INK, _FAINT, _PAPER = (30, 30, 30), (105, 105, 105), (252, 252, 250)


@dataclass(frozen=True)
class SheetCommand:
    """Draw a contact sheet: every object as the simulator shows it, with its size and mass."""

    names: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="[NAME...]")] = ()
    """Objects or kinds to draw, your own too; all if none are named. What is damaged is passed over."""
    out: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("objects.jpg")
    """A .jpg or .png; several pages become NAME-1, NAME-2 ..."""

    def run(self) -> int:
        """Draw and save the pages."""
        from torc.objects.library import load_object

        names = _chosen(self.names)
        check_picture_name(self.out, ".jpg", ".png")
        self.out.parent.mkdir(parents=True, exist_ok=True)
        cells = []
        for name in names:
            try:
                cells.append(_cell(load_object(name)))
            except InputError as error:
                tell(f"torc: {error}")
        if not cells:
            raise InputError("None of these objects can be drawn. Import them again, or name others.")
        sheets = [cells[i : i + COLUMNS * ROWS] for i in range(0, len(cells), COLUMNS * ROWS)]
        for number, sheet in enumerate(sheets, start=1):
            path = self.out if len(sheets) == 1 else self.out.with_stem(f"{self.out.stem}-{number}")
            _page(sheet).save(path, quality=82, optimize=True)
            print(f"{path}  (page {number} of {len(sheets)})", flush=True)
        return 0


def known_objects() -> list["ObjectFacts"]:
    """Return the facts of all objects, torc's own first. A damaged one is reported and stops nothing."""
    from torc.objects.library import object_facts, object_names

    found = []
    for name in object_names():
        try:
            found.append(object_facts(name))
        except InputError as error:
            tell(f"torc: {error}")
    return found


def check_picture_name(path: Path, *endings: str) -> None:
    """Raise InputError unless a picture's name has one of the endings; .jpeg counts as .jpg."""
    if path.suffix.lower().replace(".jpeg", ".jpg") not in endings:
        raise InputError(f"{path}: pictures are written as {' or '.join(endings)}. Use a name that ends so.")


def _chosen(names: Sequence[str]) -> list[str]:
    """Return names of the objects and of those of the kinds named, without those that cannot be read."""
    from torc.objects.library import object_names

    known = known_objects()
    if not names:
        return [facts.name for facts in known]
    valid = [*object_names(), *dict.fromkeys(facts.kind for facts in known)]
    for name in names:
        if name not in valid:
            raise UnknownNameError("object or kind", name, valid)
    return list(dict.fromkeys(f.name for name in names for f in known if name in (f.name, f.kind)))


def _cell(model: "ObjectModel") -> "Picture":
    """Draw a portrait; below it name, description, size (depth, width, height) and mass."""
    from PIL import Image, ImageDraw, ImageFont

    from torc.sim.portraits import portrait

    cell = Image.new("RGB", (CELL[0], CELL[1] + CAPTION), _PAPER)
    cell.paste(Image.fromarray(portrait(model, *CELL)), (0, 0))
    draw, y = ImageDraw.Draw(cell), CELL[1] + 4
    edges = " x ".join(f"{1000 * s:.0f}" for s in model.size_m)
    facts = f"{edges} mm, {1000 * model.mass_kg:.0f} g"
    for text, size, color in ((model.name, 17, _INK), (model.description, 14, _FAINT), (facts, 14, _FAINT)):
        width = draw.textlength(text, ImageFont.load_default(size))
        fitting = min(size, max(8, int(size * (CELL[0] - 14) / width)))
        draw.text((8, y), text, color, ImageFont.load_default(fitting))
        y += size + 5
    return cell


def _page(cells: Sequence["Picture"]) -> "Picture":
    from PIL import Image

    width, height = cells[0].size
    page = Image.new("RGB", (COLUMNS * width, -(-len(cells) // COLUMNS) * height), _PAPER)
    for k, cell in enumerate(cells):
        page.paste(cell, (k % COLUMNS * width, k // COLUMNS * height))
    return page
