"""A mesh file to an object model."""

import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from torc.errors import InputError, MissingDependencyError, extra_remedy
from torc.objects.files import load_object_directory, load_source
from torc.objects.importing.options import FORMATS, MeshOptions
from torc.objects.models import ObjectModel
from torc.objects.schema import ObjectSource

MAX_MESH_BYTES = 200 * 2**20
LIMIT_S, MEMORY_BYTES = 300.0, 6 * 2**30
"""Of the child process: computing time of all cores together (on the clock, four times that), and address space."""
MADE_DIRECTORY = "made"
"""Where the child process leaves the object, in a directory of its name."""
REQUEST_FILE, ANSWER_FILE = "request.json", "answer.json"
_LIBRARIES = ("trimesh", "networkx", "coacd", "fast_simplification")
# One seed for sets of text, few threads and heaps: the same answer on every machine, within the memory allowed.
_ENVIRONMENT = {
    "PYTHONHASHSEED": "0",
    "OMP_NUM_THREADS": "2",
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "2",
}


@dataclass(frozen=True, eq=False)
class MeshImport:
    """An imported mesh: the object, the file and where its frame lies in the model frame, and what was done to it."""

    model: ObjectModel
    source: ObjectSource
    notes: tuple[str, ...]


def read_mesh(path: Path | str, options: MeshOptions | None = None) -> MeshImport:
    """Reads a mesh file: surfaces to look at, convex pieces for contact, mass, model frame, and what was done.

    The same file and options give the same object.

    Args:
        path: OBJ (its MTL and textures beside it), GLB, STL or PLY.
        options: see `MeshOptions`.

    Raises:
        InputError: the file is missing, not readable, not safe to read, or no thing for a table.
        MissingDependencyError: the extra `import` is not installed.
    """
    path, options = Path(path), options or MeshOptions()
    for library in _LIBRARIES:
        if importlib.util.find_spec(library) is None:
            raise MissingDependencyError(
                f"The library {library}, which reads meshes,", extra_remedy("import")
            )
    _check_file(path)
    path = path.resolve()
    name = options.name_for(path)
    with tempfile.TemporaryDirectory(prefix="torc-import-") as folder:
        notes = _made(path, options, Path(folder))
        made = Path(folder) / MADE_DIRECTORY / name
        return MeshImport(load_object_directory(made), load_source(made), notes)


def _check_file(path: Path) -> None:
    if path.suffix[1:].lower() not in FORMATS:
        raise InputError(f"{path} is not of a format that is read: {', '.join(f.upper() for f in FORMATS)}.")
    if not path.is_file():
        raise InputError(f"There is no mesh file {path}.")
    size = path.stat().st_size
    if size > MAX_MESH_BYTES:
        raise InputError(
            f"{path} is too large: {size // 2**20} MB; at most {MAX_MESH_BYTES // 2**20}. Simplify it first."
        )


def _made(path: Path, options: MeshOptions, folder: Path) -> tuple[str, ...]:
    """Has the object made in a child process; what its owner is told. Where that process crashes or takes too long,
    another one takes the convex hull instead of decomposing the mesh."""
    plain = {**asdict(options), "root": None if options.root is None else str(options.root.resolve())}
    request = {
        "path": str(path),
        "options": plain,
        "limit_s": LIMIT_S,
        "memory_bytes": MEMORY_BYTES,
        "undecomposed": None,
    }
    answer = run_child(request, folder)
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
    """The answer of `torc.objects.importing.child`, or how it ended without one."""
    (folder / REQUEST_FILE).write_text(json.dumps(request), encoding="utf-8")
    limit_s = request["limit_s"]
    # -P: nothing is imported from the working directory, which may be a stranger's too
    command = [sys.executable, "-P", "-m", "torc.objects.importing.child", str(folder)]
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
