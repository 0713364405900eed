"""`torc objects import`: mesh files to user-defined objects."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from torc.cli.printing import print_json, printable, teller
from torc.errors import InputError, PhysicsError
from torc.objects.library import store_directories

if TYPE_CHECKING:
    from torc.objects.importing import MeshOptions


@dataclass(frozen=True)
class ImportCommand:
    """Make objects of your own out of mesh files: OBJ (with MTL and textures), GLB, STL, PLY.

    Each mesh gets convex contact pieces, a mass and a description, and is kept in your own library: the first directory
    in TORC_OBJECTS, or ~/.local/share/torc/objects. From then on it can be used by its name like any other object.
    In a directory, meshes imported before are skipped: the same command continues after Ctrl-C.
    Needs: scripts/setup import. Exit code 0 when everything was imported, 1 when something was refused.
    """

    paths: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="PATH...")]
    """Mesh files, or directories: every mesh in them and below."""
    scale: float = 1.0
    """Metres per unit of the files: 0.001 if they are in millimetres."""
    up: Literal["auto", "y", "z"] = "auto"
    """The axis of the files that points up; auto: y for GLB, z for the others."""
    as_is: bool = False
    """Keep the orientation; otherwise an object is turned to the nearest pose in which it rests."""
    mass: Annotated[float | None, tyro.conf.arg(metavar="KG")] = None
    """Mass; by default volume times density."""
    density: Annotated[float, tyro.conf.arg(metavar="KG/M3")] = 850.0
    """Density; the default is a filled package. Glass and china have 2400, wood 700, foam 60."""
    friction: float = 0.8
    """Sliding friction coefficient."""
    description: Annotated[str | None, tyro.conf.arg(metavar="WORDS")] = None
    """Short words that tell it from other objects, e.g. "the blue tuna can"; by default from the file's name."""
    name: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Its name; by default from the file's name."""
    kind: Annotated[str | None, tyro.conf.arg(metavar="KIND")] = None
    """Its kind, for variants of one thing; by default its name."""
    no_textures: bool = False
    """Leave materials and textures out."""
    library: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Where to keep the objects."""
    overwrite: bool = False
    """Replace your own objects of the same names."""
    json: Annotated[bool, tyro.conf.arg(help="Print what was imported and refused as JSON.")] = False

    def run(self) -> int:
        from torc.objects.importing.storing import check_library, kept_names

        meshes, left_out = self._meshes()
        say = teller(self.json)
        check_library(self.library)  # a mesh may take minutes
        # Of those in directories, what was imported before.
        inside = {path: str(options.name) for path, options in meshes if options.root and not self.overwrite}
        kept = kept_names(inside, self.scale, self.library)
        kept = {path: name for path, name in kept.items() if self.name in (None, name)}
        rows: list[dict[str, Any]] = []
        files: dict[str, Path] = {}
        for i, (path, options) in enumerate(meshes):
            start = f"[{i + 1}/{len(meshes)}] {path.name}"
            name = kept.get(path) or str(options.name)
            try:
                if name in files:
                    raise InputError(
                        f"'{name}' is {files[name]} in this call. Import it with another --name."
                    )
                if path in kept:
                    row: dict[str, Any] = {"there": name}
                    anew = "" if name == options.name else f", as {options.name}"
                    say(f"{start}: {name} is there already (--overwrite imports it again{anew})")
                else:
                    row = self._import_one(path, options, start)
                files[name] = path
            except (InputError, PhysicsError) as error:
                row = {"refused": str(error)}
                say(f"{start}: refused: {error}")
            rows.append({"file": str(path), **row})
        refused, there = (sum(end in row for row in rows) for end in ("refused", "there"))
        for path, why in left_out:
            rows.append({"file": str(path), "left_out": why})
            say(f"left out: {path}: {why}")
        if self.json:
            print_json(rows)
            return 1 if refused else 0
        stores = [store.resolve() for store in store_directories()]
        imported = f"{len(meshes) - refused - there} imported{f', {there} there already' if there else ''}"
        print(printable(f"\n{imported}, {refused} refused, into {self.library or stores[0]}"))
        if self.library and len(meshes) > refused and self.library.resolve() not in stores:
            print(printable(f"To use them: export TORC_OBJECTS={self.library.resolve()}"))
        return 1 if refused else 0

    def _meshes(self) -> tuple[list[tuple[Path, "MeshOptions"]], list[tuple[Path, str]]]:
        """Return mesh files, and those left out with the reason. Raises InputError for inconsistent arguments."""
        from torc.objects.importing import MeshOptions
        from torc.objects.importing.storing import find_meshes

        options = MeshOptions(
            name=self.name,
            kind=self.kind,
            description=self.description,
            scale=self.scale,
            up=self.up,
            stand=not self.as_is,
            mass_kg=self.mass,
            density_kg_m3=self.density,
            friction=self.friction,
            textures=not self.no_textures,
        )
        meshes: list[tuple[Path, MeshOptions]] = []
        left_out: list[tuple[Path, str]] = []
        for path in self.paths:
            if os.path.isdir(path):
                inside, others = find_meshes(path)
                if not inside:
                    raise InputError(f"There is no OBJ, GLB, STL or PLY file in {path}.")
                for file, stem in inside:
                    name = options.name_for(Path(f"{stem}{file.suffix}"))
                    meshes.append((file, replace(options, root=path, name=name)))
                left_out += others
            elif os.path.exists(path):
                meshes.append((path, replace(options, name=options.name_for(path))))
            else:
                raise InputError(f"There is no file or directory {path}.")
        single = [k for k in ("name", "description", "mass") if getattr(self, k) is not None]
        if not meshes:
            raise InputError("Give mesh files or directories to import.")
        if len(meshes) > 1 and single:
            raise InputError(f"--{single[0]} is for one mesh; here are {len(meshes)}.")
        return meshes, left_out

    def _import_one(self, path: Path, options: "MeshOptions", start: str) -> dict[str, Any]:
        from torc.objects.importing import read_mesh
        from torc.objects.importing.storing import add_object, check_name
        from torc.sim.portraits import stands

        check_name(str(options.name), self.library, self.overwrite)
        say = teller(self.json)
        say(f"{start}: reading ...")
        found = read_mesh(path, options)
        notes = list(found.notes)
        if not stands(found.model):
            notes.append("It does not stay where it is set down: expect it to roll or to fall over.")
        model = add_object(found, self.library, self.overwrite).model
        size, pieces = " x ".join(f"{1000 * s:.0f}" for s in model.size_m), len(model.pieces)
        say(
            f"{start}: {model.name}, {model.description}: {size} mm, {model.mass_kg:.3f} kg, {pieces} convex pieces"
        )
        for note in notes:
            say(f"    {note}")
        facts = {name: getattr(model, name) for name in ("name", "description", "mass_kg")}
        return {**facts, "size_m": list(model.size_m), "pieces": pieces, "notes": notes}
