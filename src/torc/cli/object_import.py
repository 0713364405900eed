"""`torc objects import`: mesh files to user-defined objects."""

import os
import sys
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from torc.cli.printing import print_json, printable
from torc.errors import InputError

if TYPE_CHECKING:
    from torc.objects.importing import MeshOptions

    # A file, the path that names it, and how it becomes an object.
    _Mesh = tuple[Path, Path, MeshOptions]


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
        """Import the meshes and return the exit code."""
        from torc.errors import PhysicsError
        from torc.objects.importing.storing import check_library
        from torc.objects.library import store_directories

        meshes, left_out = self._meshes()
        check_library(self.library)  # a mesh may take minutes
        kept = self._kept(meshes)
        rows: list[dict[str, Any]] = []
        files: dict[str, Path] = {}
        for i, (path, named, options) in enumerate(meshes):
            start = f"[{i + 1}/{len(meshes)}] {path.name}"
            try:
                called = options.name_for(named)
                stored = kept.get(path) or called
                if stored in files:
                    raise InputError(
                        f"'{stored}' is {files[stored]} in this call. Import it with another --name."
                    )
                if path in kept:
                    rows.append({"file": str(path), "there": stored})
                    anew = "" if stored == called else f", as {called}"
                    self._say(f"{start}: {stored} is there already (--overwrite imports it again{anew})")
                else:
                    rows.append(
                        {"file": str(path), **self._import_one(path, replace(options, name=called), start)}
                    )
                files[stored] = path
            except (InputError, PhysicsError) as error:
                rows.append({"file": str(path), "refused": str(error)})
                self._say(f"{start}: refused: {error}")
        refused, there = (sum(end in row for row in rows) for end in ("refused", "there"))
        for path, why in left_out:
            rows.append({"file": str(path), "left_out": why})
            self._say(f"left out: {path}: {why}")
        if self.json:
            print_json(rows)
            return 1 if refused else 0
        stores = [store.resolve() for store in store_directories()]
        imported = f"{len(meshes) - refused - there} imported{f', {there} there already' if there else ''}"
        print(printable(f"\n{imported}, {refused} refused, into {self.library or stores[0]}"))
        if self.library and len(meshes) > refused and self.library.resolve() not in stores:
            print(printable(f"To use them: export TORC_OBJECTS={self.library.resolve()}"))
        return 1 if refused else 0

    def _meshes(self) -> tuple[list["_Mesh"], list[tuple[Path, str]]]:
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
        meshes: list[_Mesh] = []
        left_out: list[tuple[Path, str]] = []
        for path in self.paths:
            if os.path.isdir(path):
                inside, others = find_meshes(path)
                if not inside:
                    raise InputError(f"There is no OBJ, GLB, STL or PLY file in {path}.")
                meshes += [
                    (file, Path(f"{stem}{file.suffix}"), replace(options, root=path)) for file, stem in inside
                ]
                left_out += others
            elif os.path.exists(path):
                meshes.append((path, path, options))
            else:
                raise InputError(f"There is no file or directory {path}.")
        single = [k for k in ("name", "description", "mass") if getattr(self, k) is not None]
        if not meshes:
            raise InputError("Give mesh files or directories to import.")
        if len(meshes) > 1 and single:
            raise InputError(f"--{single[0]} is for one mesh; here are {len(meshes)}.")
        return meshes, left_out

    def _kept(self, meshes: list["_Mesh"]) -> dict[Path, str]:
        """Return the meshes in directories that were imported before, with the names of the objects."""
        from torc.objects.importing.storing import kept_names

        names: dict[Path, str] = {}
        for path, named, options in meshes:
            if options.root is not None and not self.overwrite:
                with suppress(InputError):  # refused for it when its turn comes
                    names[path] = options.name_for(named)
        kept = kept_names(names, self.scale, self.library)
        return {path: name for path, name in kept.items() if self.name in (None, name)}

    def _import_one(self, path: Path, options: "MeshOptions", start: str) -> dict[str, Any]:
        from torc.objects.importing import read_mesh
        from torc.objects.importing.storing import add_object, check_name
        from torc.sim.portraits import stands

        check_name(str(options.name), self.library, self.overwrite)
        self._say(f"{start}: reading ...")
        found = read_mesh(path, options)
        notes = list(found.notes)
        if not stands(found.model):
            notes.append("It does not stay where it is set down: expect it to roll or to fall over.")
        model = add_object(found, self.library, self.overwrite).model
        size, pieces = " x ".join(f"{1000 * s:.0f}" for s in model.size_m), len(model.pieces)
        self._say(
            f"{start}: {model.name}, {model.description}: {size} mm, {model.mass_kg:.3f} kg, {pieces} convex pieces"
        )
        for note in notes:
            self._say(f"    {note}")
        facts = {name: getattr(model, name) for name in ("name", "description", "mass_kg")}
        return {**facts, "size_m": list(model.size_m), "pieces": pieces, "notes": notes}

    def _say(self, text: str) -> None:
        print(printable(text), file=sys.stderr if self.json else sys.stdout, flush=True)
