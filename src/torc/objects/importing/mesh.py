"""A mesh file to an object model."""

import importlib.util
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from torc.errors import InputError, MissingDependencyError, extra_remedy
from torc.objects.files import load_object_directory, load_source
from torc.objects.importing.guard import ChildError, run_child
from torc.objects.importing.options import FORMATS, MeshOptions
from torc.objects.models import ObjectModel
from torc.objects.schema import ObjectSource

MAX_MESH_BYTES = 200 * 2**20
MADE_DIRECTORY = "made"
"""Where the child process leaves the object, in a directory of its name."""
READ_FILE = "read"
"""It leaves this when the mesh is read and clean: what goes wrong later is the decomposition's fault."""
_LIBRARIES = ("trimesh", "networkx", "coacd", "fast_simplification")
_TASK = "torc.objects.importing.making:make_object"


@dataclass(frozen=True, eq=False)
class MeshImport:
    """An imported mesh.

    Attributes:
        model: the object.
        source: the file, its scale, and where its frame lies in the model frame.
        notes: what was done to the mesh or guessed, for its owner.
    """

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
    """Has the object made in a child process; what its owner is told. Where the decomposition ends that process or
    takes too long, another one takes the convex hull."""
    plain = {**asdict(options), "root": None if options.root is None else str(options.root.resolve())}
    request = {"path": str(path), "options": plain, "undecomposed": None}
    limits = options.limit_s, options.memory_bytes
    try:
        try:
            answer = run_child(_TASK, request, folder, *limits)
        except ChildError as error:
            if not (folder / READ_FILE).exists():
                raise
            answer = run_child(_TASK, {**request, "undecomposed": str(error)}, folder, *limits)
    except ChildError as error:
        raise InputError(
            f"{path} could not be read: {error}. If the file is sound, simplify it or leave its textures out "
            "(--no-textures)."
        ) from error
    return tuple("".join(c if c.isprintable() else "?" for c in note[:300]) for note in answer["notes"][:20])
