"""A mesh file to an object model."""

import importlib.util
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from torc.errors import InputError, MissingDependencyError, extra_remedy
from torc.fingerprints import file_fingerprint
from torc.geometry.transforms import wxyz_from_rotation
from torc.scenes.importing.decomposing import NET_FILE, decompose, read_hulls
from torc.scenes.importing.guard import ChildError, run_child
from torc.scenes.importing.hulls import reduced_hull, solid_enough
from torc.scenes.importing.options import FORMATS, MeshOptions
from torc.scenes.importing.preparing import PreparedMesh, prepare, read_prepared
from torc.scenes.importing.reading import MAX_MESH_BYTES, Y_UP
from torc.scenes.importing.resting import is_round, resting_rotation
from torc.scenes.models import CollisionPiece, ObjectModel, Vec3, VisualMesh, pieces_bounds
from torc.scenes.object_files import ObjectSource
from torc.scenes.object_schema import MAX_MASS_KG, MIN_MASS_KG, MIN_SIZE_M

Say = Callable[[str], None]
_LIES_MAYBE = (
    "It stands on z = 0 in the file, not on y = 0: if it lies on its side now, its z points up; give --up z (GLB's "
    "standard is y)."
)
_ON_ZERO, _OFF_ZERO = 0.02, 0.1
"""Share of a length by which a bounding box may miss 0 to stand on it, or must miss it not to."""
_LIBRARIES = ("mapbox_earcut", "coacd", "fast_simplification")


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


def import_mesh(path: Path | str, options: MeshOptions | None = None) -> ObjectModel:
    """The object model of a mesh file; see `read_mesh` for the rest that is known of it.

    Raises:
        InputError: the file is missing, not readable, not safe to read, or no thing for a table.
        MissingDependencyError: the extra `import` is not installed.
    """
    return read_mesh(path, options).model


def read_mesh(path: Path | str, options: MeshOptions | None = None, say: Say | None = None) -> MeshImport:
    """Reads a mesh file: surfaces to look at, convex pieces for contact, mass, model frame, and what was done.

    The same file and options give the same object.

    Args:
        path: OBJ (its MTL and textures beside it), GLB, STL or PLY.
        options: see `MeshOptions`.
        say: gets a word before each longer step.

    Raises:
        As `import_mesh`.
    """
    path, options, say = Path(path), options or MeshOptions(), say or _quiet
    _check_libraries()
    path = _check_file(path)
    options.name_for(path)
    with tempfile.TemporaryDirectory(prefix="torc-import-") as folder:
        say("reading")
        mesh = _read(path, options, Path(folder))
        say("contact pieces")
        hulls, notes = _hulls(mesh, options, Path(folder), path)
    notes += [_LIES_MAYBE] if _lies_maybe(path, options, mesh.vertices) else []
    return _assemble(path, options, mesh, hulls, [*mesh.notes, *notes])


def _check_libraries() -> None:
    missing = [name for name in _LIBRARIES if importlib.util.find_spec(name) is None]
    if missing:
        raise MissingDependencyError(f"The library {missing[0]}, which reads meshes,", extra_remedy("import"))


def _check_file(path: Path) -> Path:
    if path.suffix[1:].lower() not in FORMATS:
        raise InputError(f"{path} is not of a format that is read: {', '.join(f.upper() for f in FORMATS)}.")
    if not path.is_file():
        raise InputError(f"There is no mesh file {path}.")
    try:
        size = path.stat().st_size
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.") from None
    if size > MAX_MESH_BYTES:
        raise InputError(
            f"{path} is too large: {size // 2**20} MB; at most {MAX_MESH_BYTES // 2**20}. Simplify it first."
        )
    return path.resolve()


def _read(path: Path, options: MeshOptions, folder: Path) -> PreparedMesh:
    request = {
        "path": str(path),
        "scale": options.scale,
        "y_up": _is_y_up(path, options),
        "textures": options.textures,
        "texture_px": options.texture_px,
        "root": None if options.root is None else str(options.root.resolve()),
        "max_faces": options.max_faces,
    }
    task = f"{prepare.__module__}:{prepare.__name__}"
    try:
        answer = run_child(task, request, folder, options.read_limit_s, options.memory_bytes)
    except ChildError as error:
        raise InputError(
            f"{path} could not be read: {error}. If the file is sound, simplify it or leave its textures out "
            "(--no-textures)."
        ) from error
    return read_prepared(answer, folder)


def _hulls(
    mesh: PreparedMesh, options: MeshOptions, folder: Path, path: Path
) -> tuple[list[Float[np.ndarray, "n 3"]], list[str]]:
    """Convex pieces, and a note if it is the convex hull for want of better."""
    np.savez(folder / NET_FILE, contact_vertices=mesh.vertices, contact_faces=mesh.faces)
    request = {"concavity": options.concavity, "max_pieces": options.max_pieces}
    task, notes = f"{decompose.__module__}:{decompose.__name__}", []
    try:
        answer = run_child(task, request, folder, options.decompose_limit_s, options.memory_bytes)
        count = answer.get("hulls")
        hulls = (
            read_hulls(count, folder) if isinstance(count, int) and 0 < count <= options.max_pieces else []
        )
        hulls = [h for h in hulls if solid_enough(h)]
        why = "nothing solid came out"
    except (ChildError, InputError) as error:
        hulls, why = [], str(error)
    if not hulls:
        hulls = [mesh.vertices]
        notes.append(f"Its contact geometry is its convex hull: the decomposition failed ({why}).")
        if not solid_enough(mesh.vertices):
            raise InputError(f"{path} encloses no volume: it is flat. Give it a thickness first.")
    corners = min(options.max_piece_vertices, options.max_contact_vertices // len(hulls))
    return [reduced_hull(h, corners) for h in hulls], notes


def _assemble(
    path: Path, options: MeshOptions, mesh: PreparedMesh, hulls: Sequence[np.ndarray], notes: list[str]
) -> MeshImport:
    R = resting_rotation(hulls) if options.stand else np.eye(3)
    angle = float(np.rad2deg(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))))
    if angle > 1.0:
        notes.append(f"It was turned by {angle:.0f} degrees to where it rests.")
    turned = [h @ R.T for h in hulls]
    lower, upper = pieces_bounds([CollisionPiece("mesh", vertices=h) for h in turned])
    shift = -(lower + upper) / 2
    pieces = tuple(CollisionPiece("mesh", vertices=h + shift) for h in turned)
    size_m = _vec3(upper - lower)
    if min(size_m) < MIN_SIZE_M:
        raise InputError(f"{path} is thinner than {1000 * MIN_SIZE_M:g} mm: it would slip through contacts.")
    name = options.name_for(path)
    model = ObjectModel(
        name=name,
        kind=options.kind or name,
        description=options.description_for(path),
        mass_kg=_mass_kg(path, options, pieces),
        pieces=pieces,
        visuals=tuple(_moved(v, R, shift) for v in mesh.visuals),
        size_m=size_m,
        rolls=is_round(turned) if options.rolls is None else options.rolls,
        friction=options.friction,
        held_out=True,  # the grasp model has never seen it
    )
    w, x, y, z = (float(v) for v in wxyz_from_rotation(R @ Y_UP if _is_y_up(path, options) else R))
    file = "".join(c if c.isprintable() else "_" for c in path.name)
    sha256 = file_fingerprint(path)
    source = ObjectSource(file, "", options.scale, _vec3(shift), (w, x, y, z), sha256)
    return MeshImport(model, source, tuple(notes))


def _is_y_up(path: Path, options: MeshOptions) -> bool:
    return options.up == "y" or (options.up == "auto" and path.suffix.lower() == ".glb")


def _lies_maybe(path: Path, options: MeshOptions, vertices: Float[np.ndarray, "n 3"]) -> bool:
    """Whether a file that is read with y up looks as if z pointed up in it: it stands on z = 0, and not on y = 0."""
    if options.up != "auto" or not _is_y_up(path, options):
        return False
    _, y, z = (vertices @ Y_UP).T  # in the file's own axes
    return bool(abs(z.min()) < _ON_ZERO * np.ptp(z) and abs(y.min()) > _OFF_ZERO * np.ptp(y))


def _mass_kg(path: Path, options: MeshOptions, pieces: Sequence[CollisionPiece]) -> float:
    if options.mass_kg is not None:
        return options.mass_kg
    mass_kg = sum(p.volume_m3 for p in pieces) * options.density_kg_m3
    if not MIN_MASS_KG <= mass_kg <= MAX_MASS_KG:
        raise InputError(
            f"{path} would weigh {mass_kg:.3g} kg (volume x {options.density_kg_m3:g} kg/m3); possible are "
            f"{MIN_MASS_KG:g} to {MAX_MASS_KG:g} kg. Give --mass, or check --scale."
        )
    return mass_kg


def _moved(visual: VisualMesh, R: Float[np.ndarray, "3 3"], shift: Float[np.ndarray, "3"]) -> VisualMesh:
    normals = None if visual.normals is None else visual.normals @ R.T
    return replace(visual, vertices=visual.vertices @ R.T + shift, normals=normals)


def _vec3(values: np.ndarray) -> Vec3:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _quiet(_: str) -> None:
    pass
