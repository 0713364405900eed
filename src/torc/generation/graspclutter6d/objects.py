"""The objects of GraspClutter6D in the user's object store: each mesh is converted once."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.fingerprints import file_fingerprint
from torc.generation.graspclutter6d.reading import object_stem
from torc.geometry.transforms import Pose
from torc.objects.files import load_source
from torc.objects.importing.mesh import MeshImport, read_mesh
from torc.objects.importing.options import MeshOptions
from torc.objects.importing.storing import add_object
from torc.objects.models import ObjectModel
from torc.objects.schema import ObjectSource
from torc.objects.store import find_stored, load_stored, store_directories

_NOTE = "GraspClutter6D, CC-BY-SA-4.0"
_FOLDERS = {
    "models_obj_m": ("obj", 1.0),
    "models_m": ("ply", 1.0),
    "models_obj": ("obj", 1e-3),
    "models": ("ply", 1e-3),
    "models_obj_eval": ("obj", 1e-3),
    "models_eval": ("ply", 1e-3),
}
"""Folders of meshes, the best first: ending and unit in metres."""


@dataclass(frozen=True, eq=False)
class ConvertedObject:
    """An object of the data set as one of ours.

    Attributes:
        model: the object, by its name in the store.
        T_object_mesh: pose of the mesh frame (in metres) in the model frame.
        notes: what was done to the mesh or odd about it, if it was converted just now.
    """

    model: ObjectModel
    T_object_mesh: Pose
    notes: tuple[str, ...]

    @property
    def visible_points(self) -> Float[np.ndarray, "n 3"]:
        """Vertices of its surfaces, model frame."""
        return np.concatenate([visual.vertices for visual in self.model.visuals])


def find_mesh(root: Path, object_id: int) -> tuple[Path, float]:
    """The best mesh of an object and its unit in metres: the full ones first, textured before coloured, metres before
    millimetres. Raises InputError if there is none."""
    name = object_stem(object_id)
    for folder, (ending, unit_m) in _FOLDERS.items():
        # obj2mjcf moves each mesh into a folder of its own.
        for path in (root / folder / f"{name}.{ending}", root / folder / name / f"{name}.{ending}"):
            if path.is_file():
                return path, unit_m
    raise InputError(
        f"{root} has no mesh of {name}. Unpack one of {', '.join(f'{f}.7z' for f in _FOLDERS)} there; models_obj_m is "
        "the best."
    )


def model_name(object_id: int) -> str:
    """Name of an object in the store: gc6d_000017."""
    return f"gc6d_{object_id:06d}"


def check_meshes(root: Path, object_ids: Iterable[int]) -> None:
    """Raises InputError for an object that is neither in the store nor has a mesh; converts nothing."""
    for object_id in object_ids:
        if find_stored(model_name(object_id)) is None:
            find_mesh(root, object_id)


def convert_object(root: Path, object_id: int, words: str, say: Callable[[str], None]) -> ConvertedObject:
    """An object of the data set: from the store, or converted now and put there.

    Args:
        root: of the data set.
        object_id: 1..200.
        words: its description; gets a number if another object is described so.
        say: told if it has to be converted, which takes seconds to a minute.

    Raises:
        InputError: it has no mesh, the mesh cannot be used, or the store holds something else of that name, or what
            another mesh became.
        MissingDependencyError: the extra `import` is not installed.
    """
    name, notes = model_name(object_id), tuple[str, ...]()
    stored = find_stored(name)
    if stored is None:
        say(f"converting {name}: {words}")
        found, notes = _read(*find_mesh(root, object_id), name, words)
        add_object(found, note=_NOTE)
        stored = store_directories()[0] / name
    source = load_source(stored)
    if source.note != _NOTE:
        raise InputError(
            f"{stored} is not from GraspClutter6D, but has the name of one of its objects. Move it away."
        )
    _check_mesh(root, object_id, source, stored)
    return ConvertedObject(load_stored(stored), source.T_object_mesh, notes)


def _check_mesh(root: Path, object_id: int, source: ObjectSource, stored: Path) -> None:
    """Raises InputError where the stored object was made from another mesh than the data set's, which may be gone."""
    try:
        path, _ = find_mesh(root, object_id)
    except InputError:
        return
    if source.sha256 not in ("", file_fingerprint(path)):
        raise InputError(
            f"{stored} was made from another mesh than {path}. Move it away to have this one converted, or name "
            "another directory for your objects in TORC_OBJECTS."
        )


def _read(path: Path, unit_m: float, name: str, words: str) -> tuple[MeshImport, tuple[str, ...]]:
    """The mesh by its folder's unit; by the other one, and a note, where only that gives a thing of a possible size."""
    try:
        found = read_mesh(path, MeshOptions(name=name, description=words, scale=unit_m))
        return found, found.notes
    except InputError as error:
        other_m, unit = (1.0, "metres") if unit_m != 1.0 else (1e-3, "millimetres")
        try:
            found = read_mesh(path, MeshOptions(name=name, description=words, scale=other_m))
        except InputError:
            raise error from None
        return found, (f"its mesh in {path.parent} is in {unit}, against the folder's name", *found.notes)
