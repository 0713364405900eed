"""Convert a mesh file to an object model."""

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from torc.errors import InputError, MissingDependencyError, extra_remedy
from torc.objects.models import ObjectModel
from torc.objects.object_files import load_object_directory, load_source
from torc.objects.schema import (
    MAX_DESCRIPTION,
    MAX_FRICTION,
    MAX_MASS_KG,
    MIN_FRICTION,
    MIN_MASS_KG,
    NAME_PATTERN,
    ObjectSource,
)

MAX_MESH_BYTES = 200 * 2**20
LIMIT_S, MEMORY_BYTES = 300.0, 6 * 2**30
"""Limits of the child process: computing time of all cores together (wall time: four times that), and address space."""
MADE_DIRECTORY = "made"
"""Where the child process leaves the object, in a directory of its name."""
REQUEST_FILE, ANSWER_FILE = "request.json", "answer.json"
_LIBRARIES = ("trimesh", "networkx", "coacd", "fast_simplification")
# One seed for sets of text, few threads and heaps: every machine gives one answer, within the memory allowed.
_ENVIRONMENT = {
    "PYTHONHASHSEED": "0",
    "OMP_NUM_THREADS": "2",
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "2",
}
UpAxis = Literal["auto", "y", "z"]
FORMATS = ("obj", "glb", "stl", "ply")


@dataclass(frozen=True)
class MeshOptions:
    """How a mesh becomes an object. The defaults suit a solid, filled household thing in metres.

    Attributes:
        name, kind, description: by default the file's name, that name again, and "the " and the name in words.
        scale: metres per unit of the file, e.g. 0.001 for millimetres.
        up: axis of the file that points up; "auto" is y for GLB, by its standard, and z otherwise.
        stand: turn the object until it rests where it is set down; False keeps the file's axes.
        mass_kg: by default volume of the contact pieces x density.
        density_kg_m3: of filled containers, fruit and tools on average (individually 0.5 to 2.4 g/cm3).
        rolls: adds rolling friction; None: if it is round about some axis.
        root: textures are read from this directory and below; by default from the mesh's own.
    """

    name: str | None = None
    kind: str | None = None
    description: str | None = None
    scale: float = 1.0
    up: UpAxis = "auto"
    stand: bool = True
    mass_kg: float | None = None
    density_kg_m3: float = 850.0
    friction: float = 0.8
    rolls: bool | None = None
    textures: bool = True
    root: Path | None = None

    def __post_init__(self) -> None:
        for what, value, (low, high) in (
            ("scale", self.scale, (1e-6, 1e6)),
            ("mass", self.mass_kg, (MIN_MASS_KG, MAX_MASS_KG)),
            ("density", self.density_kg_m3, (1.0, 25_000.0)),
            ("friction", self.friction, (MIN_FRICTION, MAX_FRICTION)),
        ):
            if value is not None and not low <= value <= high:
                raise InputError(f"The {what} must be between {low:g} and {high:g}, not {value}.")
        words = "the object" if self.description is None else self.description
        if not (words.strip() and len(words) <= MAX_DESCRIPTION and words.isprintable()):
            raise InputError(
                f"A description is a line of 1 to {MAX_DESCRIPTION} characters that can be printed."
            )
        for what, name in (("name", self.name), ("kind", self.kind)):
            if name is not None and not re.fullmatch(NAME_PATTERN, name):
                raise InputError(
                    f"'{name}' cannot be a {what}: 1 to 64 letters, digits, '_', '-' or '.', starting with a letter "
                    "or digit."
                )

    def name_for(self, path: Path) -> str:
        """Return the object's name: the given one, or one made from the end of the file's name.

        For letters of a non-Latin script it is made from their checksum, so that it is reproducible.
        """
        if self.name is not None:
            return self.name
        name = re.sub(r"[^A-Za-z0-9_.\-]+", "_", path.stem).strip("_.-").lower()
        if not name or _unreadable(path):
            checksum = zlib.crc32(path.stem.encode(errors="surrogateescape"))
            name = f"object_{name}_{checksum:08x}".replace("__", "_")
        return name[-64:].lstrip("_.-")  # files of a deep tree differ at the end

    def description_for(self, path: Path) -> str:
        """Return the given description, or the name in words."""
        if self.description is not None:
            return self.description
        if _unreadable(path) and path.stem.isprintable():
            return f"the {path.stem}"[:MAX_DESCRIPTION]
        return "the " + re.sub(r"[_.\-\s]+", " ", self.name_for(path)).strip()


def _unreadable(path: Path) -> bool:
    """Check whether a file's name has letters, but none that an object's name can have."""
    letters = [c for c in path.stem if c.isalpha()]
    return bool(letters) and not any(c.isascii() for c in letters)


@dataclass(frozen=True, eq=False)
class MeshImport:
    """An imported mesh: the object, the file and its frame in the model frame, and what was done to it."""

    model: ObjectModel
    source: ObjectSource
    notes: tuple[str, ...]


def read_mesh(path: Path | str, options: MeshOptions | None = None) -> MeshImport:
    """Convert a mesh file to an object: OBJ (with MTL and textures beside it), GLB, STL or PLY. Reproducible.

    Raises InputError if the file is missing, not readable, not safe to read, or not a thing for a table, and
    MissingDependencyError without the extra `import`.
    """
    path, options = Path(path), options or MeshOptions()
    for library in _LIBRARIES:
        if importlib.util.find_spec(library) is None:
            raise MissingDependencyError(
                f"The library {library}, which reads meshes,", extra_remedy("import")
            )
    if path.suffix[1:].lower() not in FORMATS:
        raise InputError(f"{path} is not of a format that is read: {', '.join(f.upper() for f in FORMATS)}.")
    if not path.is_file():
        raise InputError(f"There is no mesh file {path}.")
    size = path.stat().st_size
    if size > MAX_MESH_BYTES:
        raise InputError(
            f"{path} is too large: {size // 2**20} MB; at most {MAX_MESH_BYTES // 2**20}. Simplify it first."
        )
    path = path.resolve()
    name = options.name_for(path)
    with tempfile.TemporaryDirectory(prefix="torc-import-") as folder:
        notes = _made(path, options, Path(folder))
        made = Path(folder) / MADE_DIRECTORY / name
        return MeshImport(load_object_directory(made), load_source(made), notes)


def _made(path: Path, options: MeshOptions, folder: Path) -> tuple[str, ...]:
    """Make the object in a child process; return the messages for the user.

    If that process crashes or takes too long, another one uses the convex hull instead of decomposing the mesh.
    """
    plain = {**asdict(options), "root": None if options.root is None else str(options.root.resolve())}
    request = {"path": str(path), "options": plain, "limit_s": LIMIT_S, "memory_bytes": MEMORY_BYTES}
    answer = run_child({**request, "undecomposed": None}, folder)
    if "ended" in answer:
        answer = run_child({**request, "undecomposed": answer["ended"]}, folder)
    if "refused" in answer:
        raise InputError(answer["refused"])
    if "notes" not in answer:
        raise InputError(
            f"{path} could not be read: {answer.get('failed') or answer['ended']}. If the file is sound, simplify it "
            "or leave its textures out (--no-textures)."
        )
    return tuple("".join(c if c.isprintable() else "?" for c in note[:300]) for note in answer["notes"][:20])


def run_child(request: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the answer of `torc.objects.importing.making`, or how it ended without one."""
    (folder / REQUEST_FILE).write_text(json.dumps(request), encoding="utf-8")
    limit_s = request["limit_s"]
    # -P: nothing is imported from the working directory, which may also be a stranger's
    command = [sys.executable, "-P", "-m", "torc.objects.importing.making", str(folder)]
    late = {"ended": f"it took longer than {limit_s:g} s of computing"}
    try:
        code = subprocess.run(
            command,
            env={**os.environ, **_ENVIRONMENT},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=4 * limit_s,
            check=False,
        ).returncode
    except subprocess.TimeoutExpired:
        return late
    try:
        return dict(json.loads((folder / ANSWER_FILE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        if code == -getattr(signal, "SIGXCPU", 0):
            return late
        return {"ended": f"the process ended with code {code}"}
