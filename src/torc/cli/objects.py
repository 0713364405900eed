"""`torc objects`: objects to put on the table, and how to add to them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from torc.cli.commands import Group
from torc.cli.object_import import ImportCommand
from torc.cli.object_sheet import SheetCommand, check_picture_name, known_objects
from torc.cli.printing import print_json
from torc.errors import UnknownNameError


@dataclass(frozen=True)
class ListCommand:
    """List the objects: those that come with torc, and your own."""

    kind: Annotated[str | None, tyro.conf.arg(metavar="KIND")] = None
    """Only of this kind, e.g. mug."""
    own: bool = False
    """Only your own."""
    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print a line per object."""
        from torc.objects.library import graspable

        found = known_objects()
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
    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print the facts."""
        if self.picture is not None:
            check_picture_name(self.picture, ".png")
        facts = _facts(self.name)
        if self.picture is not None:
            from PIL import Image

            from torc.objects.library import load_object
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
    from torc.objects.library import find_stored, graspable, load_object, object_facts
    from torc.objects.object_files import load_source

    model, own = load_object(name), not object_facts(name).builtin
    plain = {
        key: getattr(model, key) for key in ("name", "kind", "description", "mass_kg", "friction", "rolls")
    }
    facts: dict[str, Any] = {
        **plain,
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
