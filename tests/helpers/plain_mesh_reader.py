"""A stand-in for the mesh importer: instant, for convex meshes, refusing the same sizes."""

from pathlib import Path

import numpy as np
import trimesh

from torc.errors import InputError
from torc.objects.importing import MeshImport, MeshOptions
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh
from torc.objects.schema import MAX_SIZE_M, MIN_SIZE_M, ObjectSource


def read_plain_mesh(path: Path | str, options: MeshOptions | None = None) -> MeshImport:
    """Like `torc.objects.importing.read_mesh`, for files of one convex body; never turned."""
    path, options = Path(path), options or MeshOptions()
    mesh = trimesh.load_mesh(path, process=False)
    vertices, faces = options.scale * np.array(mesh.vertices), np.array(mesh.faces)
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
