"""A stand-in for the mesh importer: instant, for convex meshes in plain text, refusing the same sizes."""

from pathlib import Path

import numpy as np

from torc.errors import InputError
from torc.objects.importing import MeshImport, MeshOptions
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh
from torc.objects.schema import MAX_SIZE_M, MIN_SIZE_M, ObjectSource


def read_plain_mesh(path: Path | str, options: MeshOptions | None = None) -> MeshImport:
    """Like `torc.objects.importing.read_mesh`, for OBJ and ASCII PLY files of one convex body; never turned."""
    path, options = Path(path), options or MeshOptions()
    vertices, faces = (_read_obj if path.suffix == ".obj" else _read_ply)(path.read_text())
    vertices = options.scale * vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = high - low
    if not (size.min() >= MIN_SIZE_M and size.max() <= MAX_SIZE_M):
        raise InputError(f"{path} is {size.max():.4g} m large.")
    shift = -(low + high) / 2
    name = options.name_for(path)
    x, y, z = (float(v) for v in size)
    dx, dy, dz = (float(v) for v in shift)
    model = ObjectModel(
        name=name,
        kind=name,
        description=options.description_for(path),
        mass_kg=400.0 * x * y * z,
        pieces=(CollisionPiece("mesh", vertices=vertices + shift),),
        visuals=(VisualMesh(vertices + shift, faces, rgba=(0.7, 0.3, 0.2, 1.0)),),
        size_m=(x, y, z),
    )
    return MeshImport(model, ObjectSource(file=path.name, scale=options.scale, position=(dx, dy, dz)), ())


def _read_obj(text: str) -> tuple[np.ndarray, np.ndarray]:
    lines = [line.split() for line in text.splitlines() if line.strip()]
    vertices = [[float(v) for v in words[1:4]] for words in lines if words[0] == "v"]
    faces = [[int(v.split("/")[0]) - 1 for v in words[1:4]] for words in lines if words[0] == "f"]
    return np.array(vertices), np.array(faces)


def _read_ply(text: str) -> tuple[np.ndarray, np.ndarray]:
    header, body = text.split("end_header\n")
    counts = [int(line.split()[2]) for line in header.splitlines() if line.startswith("element")]
    rows = [line.split() for line in body.splitlines()]
    vertices = [[float(v) for v in row[:3]] for row in rows[: counts[0]]]
    faces = [[int(v) for v in row[1:4]] for row in rows[counts[0] : counts[0] + counts[1]]]
    return np.array(vertices), np.array(faces)
