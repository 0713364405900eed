"""`torc objects`: objects to put on the table, what they look like, and how to add to them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from torc.cli.commands import Group
from torc.cli.object_import import ImportCommand
from torc.cli.options import JsonOption, check_picture_name
from torc.cli.printing import print_json, tell
from torc.errors import InputError, UnknownNameError
from torc.objects.library import ObjectFacts, find_stored, graspable, load_object, object_facts, object_names

if TYPE_CHECKING:  # the command line answers before Pillow and MuJoCo are imported
    from PIL.Image import Image as Picture

    from torc.objects.models import ObjectModel

COLUMNS, ROWS = 5, 8
CELL, CAPTION = (250, 205), 68
_INK, _FAINT, _PAPER = (30, 30, 30), (105, 105, 105), (252, 252, 250)


@dataclass(frozen=True)
class ListCommand:
    """List the objects: those that come with torc, and your own."""

    kind: Annotated[str | None, tyro.conf.arg(metavar="KIND")] = None
    """Only of this kind, e.g. mug."""
    own: bool = False
    """Only your own."""
    json: JsonOption = False

    def run(self) -> int:
        found = _known_objects()
        kinds = sorted({facts.kind for facts in found})
        if self.kind is not None and self.kind not in kinds:
            raise UnknownNameError("kind of object", self.kind, kinds)
        found = [f for f in found if self.kind in (None, f.kind) and not (self.own and f.builtin)]
        if self.json:
            names = ("name", "kind", "description", "mass_kg")
            rows = [{key: getattr(f, key) for key in names} for f in found]
            print_json(
                [r | {"graspable": graspable(f.name), "own": not f.builtin} for r, f in zip(rows, found)]
            )
            return 0
        width = max((len(f.name) for f in found), default=0)
        for f in found:
            own = "" if f.builtin else "   (yours)"
            print(f"{f.name:<{width}}  {f.kind:<18} {f.mass_kg:6.3f} kg  {f.description}{own}")
        if not found:
            print("None. `torc objects import MESH` adds objects of your own.")
        return 0


@dataclass(frozen=True)
class ShowCommand:
    """Show what is known of one object, and what it looks like."""

    name: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="NAME")]
    """Name of the object (`torc objects list`)."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Also write a picture (PNG), drawn by the simulator."""
    json: JsonOption = False

    def run(self) -> int:
        if self.picture is not None:
            check_picture_name(self.picture, ".png")
        facts = _facts(self.name)
        if self.picture is not None:
            from PIL import Image

            from torc.sim.portraits import portrait

            Image.fromarray(portrait(load_object(self.name), 640, 640)).save(self.picture)
        if self.json:
            print_json(facts)
            return 0
        size = " x ".join(f"{1000 * s:.0f}" for s in facts["size_m"])
        print(f"{facts['name']}: {facts['description']}\n")
        print(f"  kind       {facts['kind']}{'' if facts['own'] else ' (comes with torc)'}")
        print(f"  size       {size} mm (depth, width, height, seen from the robot)")
        rolls = ", rolls" if facts["rolls"] else ""
        print(f"  mass       {facts['mass_kg']:.3f} kg, friction {facts['friction']:g}{rolls}")
        print(f"  contact    {facts['pieces']} convex pieces")
        if facts["graspable"] is not None:
            held = "gets" if facts["graspable"] else "does not get"
            print(f"  gripper    {held} hold of it as it stands")
        print(f"  to look at {facts['triangles']} triangles, {facts['textures']} textures")
        if facts["own"]:
            print(f"  from       {facts['source']} (scale {facts['scale']:g})")
            print(f"  stored in  {facts['directory']}")
        if self.picture is not None:
            print(f"\nPicture: {self.picture}")
        return 0


@dataclass(frozen=True)
class SheetCommand:
    """Draw a contact sheet: every object as the simulator shows it, with its size and mass."""

    names: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="[NAME...]")] = ()
    """Objects or kinds to draw, your own too; all if none are named. What is damaged is passed over."""
    out: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("objects.jpg")
    """A .jpg or .png; several pages become NAME-1, NAME-2 ..."""

    def run(self) -> int:
        from PIL import Image

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
            width, height = sheet[0].size
            page = Image.new("RGB", (COLUMNS * width, -(-len(sheet) // COLUMNS) * height), _PAPER)
            for k, cell in enumerate(sheet):
                page.paste(cell, (k % COLUMNS * width, k // COLUMNS * height))
            page.save(path, quality=82, optimize=True)
            print(f"{path}  (page {number} of {len(sheets)})", flush=True)
        return 0


OBJECTS = Group(
    "Objects to put on the table: those that come with torc, and your own.",
    {
        "list": ("what there is", ListCommand),
        "show": ("one object: size, mass, shape, and what it looks like", ShowCommand),
        "sheet": ("a picture of many", SheetCommand),
        "import": ("make objects of your own out of meshes", ImportCommand),
    },
    "Try:\n"
    "  torc objects list --kind mug\n"
    "  torc objects show mug_red --picture mug.png\n"
    "  torc objects sheet mug bowl --out dishes.png\n"
    "  torc objects import mug.glb            # from then on `mug` is an object",
)


def _facts(name: str) -> dict[str, Any]:
    from torc.objects.object_files import load_source

    model, own = load_object(name), not object_facts(name).builtin
    plain = ("name", "kind", "description", "mass_kg", "friction", "rolls")
    facts: dict[str, Any] = {key: getattr(model, key) for key in plain} | {
        "own": own,
        "size_m": list(model.size_m),
        "graspable": graspable(name),
        "pieces": len(model.pieces),
        "triangles": sum(len(v.faces) for v in model.visuals),
        "textures": sum(v.texture is not None for v in model.visuals),
    }
    directory = find_stored(name) if own else None
    if directory is not None:
        source = load_source(directory)
        facts |= {"source": source.file, "scale": source.scale, "note": source.note}
        facts["directory"] = str(directory)
    return facts


def _known_objects() -> list[ObjectFacts]:
    """Return the facts of all objects, torc's own first. A damaged one is reported and stops nothing."""
    found = []
    for name in object_names():
        try:
            found.append(object_facts(name))
        except InputError as error:
            tell(f"torc: {error}")
    return found


def _chosen(names: Sequence[str]) -> list[str]:
    """Return names of the objects and of those of the kinds named, without those that cannot be read."""
    known = _known_objects()
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
