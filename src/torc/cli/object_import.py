"""`torc objects import`: mesh files to objects of one's own."""

import json as json_module
import os
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from torc.cli.printing import printable

if TYPE_CHECKING:
    from torc.objects.importing import MeshOptions


@dataclass(frozen=True)
class ImportCommand:
    """Make objects of your own out of mesh files: OBJ (with MTL and textures), GLB, STL, PLY.

    Each mesh gets convex contact pieces, a mass and a description, and is kept in your own library: the first directory
    in TORC_OBJECTS, or ~/.local/share/torc/objects. From then on it can be used by its name like any other object.
    Of a directory, what was imported before is passed over: the same command goes on after Ctrl-C.
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
        """Import the meshes; returns the exit code."""
        from torc.errors import InputError, PhysicsError
        from torc.objects.importing.storing import check_library

        meshes, left_out = self._meshes()
        check_library(self.library)  # a mesh may take minutes
        kept = self._kept(meshes)
        rows: list[dict[str, Any]] = []
        files: dict[str, Path] = {}
        for i, (path, name, root) in enumerate(meshes):
            start = f"[{i + 1}/{len(meshes)}] {path.name}"
            try:
                options = self._options(self.name, name, root)
                called = options.name_for(path)
                kept_as = None if root is None else kept.get(path)
                stored = kept_as or called
                if stored in files:
                    raise InputError(
                        f"'{stored}' is {files[stored]} in this call. Import it with another --name."
                    )
                if kept_as:
                    rows.append({"file": str(path), "there": kept_as})
                    anew = "" if kept_as == called else f", as {called}"
                    self._say(f"{start}: {kept_as} is there already (--overwrite imports it again{anew})")
                else:
                    rows.append(self._import_one(path, options, start))
                files[stored] = path
            except (InputError, PhysicsError) as error:
                rows.append({"file": str(path), "refused": str(error)})
                self._say(f"{start}: refused: {error}")
        refused = sum("refused" in row for row in rows)
        for path, why in left_out:
            rows.append({"file": str(path), "left_out": why})
            self._say(f"left out: {path}: {why}")
        if self.json:
            print(json_module.dumps(rows, indent=2))
        else:
            there = sum("there" in row for row in rows)
            imported = (
                f"{len(meshes) - refused - there} imported{f', {there} there already' if there else ''}"
            )
            self._say(f"\n{imported}, {refused} refused, into {self._library()}")
            if len(meshes) > refused:
                self._tell_where()
        return 1 if refused else 0

    def _meshes(self) -> tuple[list[tuple[Path, str | None, Path | None]], list[tuple[Path, str]]]:
        """Mesh files, each with what its name is made of and the directory it may read from; and those left out.

        Raises InputError for arguments that make no sense.
        """
        from torc.errors import InputError
        from torc.objects.importing.storing import find_meshes

        self._options(self.name)
        named: list[tuple[Path, str | None, Path | None]] = []
        left_out: list[tuple[Path, str]] = []
        for path in self.paths:
            if os.path.isdir(path):
                inside, others = find_meshes(path)
                if not inside:
                    raise InputError(f"There is no OBJ, GLB, STL or PLY file in {path}.")
                named, left_out = named + [(p, n, path) for p, n in inside], left_out + others
            elif os.path.exists(path):
                named.append((path, None, None))
            else:
                raise InputError(f"There is no file or directory {path}.")
        single = [k for k in ("name", "description", "mass") if getattr(self, k) is not None]
        if not named:
            raise InputError("Give mesh files or directories to import.")
        if len(named) > 1 and single:
            raise InputError(f"--{single[0]} is for one mesh; here are {len(named)}.")
        return named, left_out

    def _options(self, name: str | None, stem: str | None = None, root: Path | None = None) -> "MeshOptions":
        from torc.objects.importing import MeshOptions

        if name is None and stem is not None:
            name = MeshOptions().name_for(Path(f"{stem}.obj"))
        return MeshOptions(
            name=name,
            kind=self.kind,
            description=self.description,
            scale=self.scale,
            up=self.up,
            stand=not self.as_is,
            mass_kg=self.mass,
            density_kg_m3=self.density,
            friction=self.friction,
            textures=not self.no_textures,
            root=root,
        )

    def _kept(self, meshes: list[tuple[Path, str | None, Path | None]]) -> dict[Path, str]:
        """Of the meshes in directories, those that were imported before, with the names of the objects."""
        from torc.errors import InputError
        from torc.objects.importing.storing import kept_names

        names: dict[Path, str] = {}
        for path, name, root in meshes:
            if root is not None and not self.overwrite:
                with suppress(InputError):  # refused for it when its turn comes
                    names[path] = self._options(self.name, name, root).name_for(path)
        kept = kept_names(names, self.scale, self.library)
        return {path: name for path, name in kept.items() if self.name in (None, name)}

    def _import_one(self, path: Path, options: "MeshOptions", start: str) -> dict[str, Any]:
        from torc.objects.importing import read_mesh
        from torc.objects.importing.storing import add_object, check_name
        from torc.sim.object_check import check_object

        check_name(options.name_for(path), self.library, self.overwrite)
        self._say(f"{start}: reading ...")
        found = read_mesh(path, options)
        notes = list(found.notes)
        if not check_object(found.model).stands:
            notes.append("It does not stay where it is set down: expect it to roll or to fall over.")
        model = add_object(found, self.library, self.overwrite).model
        x, y, z = (1000 * s for s in model.size_m)
        self._say(
            f"{start}: {model.name}, {model.description}: {x:.0f} x {y:.0f} x {z:.0f} mm, {model.mass_kg:.3f} kg, "
            f"{len(model.pieces)} convex pieces"
        )
        for note in notes:
            self._say(f"    {note}")
        return {
            "file": str(path),
            "name": model.name,
            "description": model.description,
            "size_m": list(model.size_m),
            "mass_kg": model.mass_kg,
            "pieces": len(model.pieces),
            "notes": notes,
        }

    def _library(self) -> Path:
        from torc.objects.store import store_directories

        return self.library or store_directories()[0]

    def _tell_where(self) -> None:
        from torc.objects.store import store_directories

        if self.library is not None and self.library.resolve() not in [
            d.resolve() for d in store_directories()
        ]:
            self._say(f"To use them: export TORC_OBJECTS={self.library.resolve()}")

    def _say(self, text: str) -> None:
        print(printable(text), file=sys.stderr if self.json else sys.stdout, flush=True)
