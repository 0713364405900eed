"""`torc objects`: what there is to put on the table, and how to add to it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from torc.cli.commands import Group
from torc.cli.object_import import ImportCommand
from torc.cli.object_sheet import SheetCommand, check_picture_name, known_objects
from torc.cli.printing import print_json
from torc.errors import UnknownNameError

_GRIPPER = {True: "gets hold of it as it stands", False: "does not get hold of it as it stands"}


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
        from torc.objects.grasp_facts import graspable

        found = known_objects()
        kinds = sorted({facts.kind for facts in found})
        if self.kind is not None and self.kind not in kinds:
            raise UnknownNameError("kind of object", self.kind, kinds)
        found = [f for f in found if self.kind in (None, f.kind) and not (self.own and f.builtin)]
        if self.json:
            keys = ("name", "kind", "description", "mass_kg", "graspable", "own")
            rows = [
                (f.name, f.kind, f.description, f.mass_kg, graspable(f.name), not f.builtin) for f in found
            ]
            print_json([dict(zip(keys, row)) for row in rows])
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
    """Also write a picture (PNG), drawn by the simulator: from the robot's side and from above."""
    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print the facts."""
        if self.picture is not None:
            check_picture_name(self.picture, ".png")
        facts = _facts(self.name)
        if self.picture is not None:
            _write_picture(self.name, self.picture)
        if self.json:
            print_json(facts)
            return 0
        x, y, z = (1000 * s for s in facts["size_m"])
        print(f"{facts['name']}: {facts['description']}\n")
        print(f"  kind       {facts['kind']}{'' if facts['own'] else ' (comes with torc)'}")
        print(f"  size       {x:.0f} x {y:.0f} x {z:.0f} mm (depth, width, height, seen from the robot)")
        rolls = ", rolls" if facts["rolls"] else ""
        print(f"  mass       {facts['mass_kg']:.3f} kg, friction {facts['friction']:g}{rolls}")
        print(f"  contact    {facts['pieces']} convex pieces")
        if facts["graspable"] is not None:
            print(f"  gripper    {_GRIPPER[facts['graspable']]}")
        print(f"  to look at {facts['triangles']} triangles, {facts['textures']} textures")
        if facts["own"]:
            print(
                f"  from       {facts['source']} (scale {facts['scale']:g})\n  stored in  {facts['directory']}"
            )
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
    from torc.objects.files import load_source
    from torc.objects.grasp_facts import graspable
    from torc.objects.library import load_object, object_facts
    from torc.objects.store import find_stored

    model, own = load_object(name), not object_facts(name).builtin
    facts: dict[str, Any] = {
        "name": model.name,
        "kind": model.kind,
        "description": model.description,
        "own": own,
        "size_m": list(model.size_m),
        "mass_kg": model.mass_kg,
        "friction": model.friction,
        "rolls": model.rolls,
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


def _write_picture(name: str, path: Path) -> None:
    """From the robot's side, and from above."""
    import numpy as np
    from PIL import Image

    from torc.objects.library import load_object
    from torc.sim.object_check import world_with
    from torc.sim.rendering import render_view

    model = load_object(name)
    world = world_with(model)
    x, y, z = (float(v) for v in world.positions[0])
    away = 1.6 * float(np.linalg.norm(model.size_m)) + 0.05
    eyes = [(x - away, y, z + 0.25 * away), (x - 0.6 * away, y - 0.6 * away, z + 0.7 * away)]
    views = [render_view(world, eye, (x, y, z), 640, 640, 0.6) for eye in eyes]
    Image.fromarray(np.concatenate(views, axis=1)).save(path)
