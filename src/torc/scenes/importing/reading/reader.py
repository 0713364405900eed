"""Mesh files to surfaces in metres, z up."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from torc.errors import InputError
from torc.scenes.importing.reading.formats import is_format, no_such_format
from torc.scenes.importing.reading.gltf.surfaces import read_glb
from torc.scenes.importing.reading.limits import MAX_FILE_FACES, MAX_FILE_VERTICES, MAX_PARTS
from torc.scenes.importing.reading.neighbours import Neighbours
from torc.scenes.importing.reading.obj.surfaces import read_obj
from torc.scenes.importing.reading.ply.surfaces import read_ply
from torc.scenes.importing.reading.request import Reading, SurfaceReader
from torc.scenes.importing.reading.stl import read_stl
from torc.scenes.importing.surfaces import Surface

Y_UP = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""y up and the front towards +z (glTF) to z up and the front towards -x."""
_MAX_NAMES = 20
_READERS: dict[str, SurfaceReader] = {"glb": read_glb, "obj": read_obj, "ply": read_ply, "stl": read_stl}


def read_surfaces(
    path: Path, scale: float, y_up: bool, root: Path | None, texture_px: int
) -> tuple[list[Surface], list[str]]:
    """The surfaces in a mesh file, metres, z up; and what a user should know about the reading.

    Args:
        path: the file.
        scale: metres per unit of it.
        y_up: its y axis points up.
        root: materials and textures are read from this directory and below; None: not at all.
        texture_px: longest side of a texture.

    Raises:
        InputError: not readable, too large, without triangles, or it points to files that it may not read.
    """
    kind = path.suffix[1:].lower()
    data = path.read_bytes()
    if not is_format(data, kind):  # readers take what is left of a file that is cut off, or of another format
        raise InputError(f"{path} {no_such_format(data, kind)}")
    neighbours = None if root is None else Neighbours(path.parent, root)
    reading = Reading(path, neighbours, texture_px)
    found = _within_limits(_READERS[kind](data, reading), path)
    if neighbours is not None and neighbours.refused:
        raise InputError(
            f"{path}: {neighbours.refused[0]}. Import the directory that holds both, or put a sound file beside the "
            "mesh and correct the name, or leave materials out (--no-textures)."
        )
    if not found:
        raise InputError(f"{path} holds no triangles.")
    for name in list(dict.fromkeys(neighbours.missing if neighbours else ()))[:_MAX_NAMES]:
        reading.note(f"'{name}' is not there: its colours are missing.")
    R = scale * (Y_UP if y_up else np.eye(3))
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is left out later
        return [replace(s, vertices=s.vertices @ R.T) for s in found], reading.notes


def _within_limits(surfaces: Iterable[Surface], path: Path) -> list[Surface]:
    found: list[Surface] = []
    faces = vertices = 0
    for number, surface in enumerate(surfaces, 1):
        if number > MAX_PARTS:
            raise InputError(f"{path} has more than {MAX_PARTS} parts. Join them into one mesh first.")
        faces, vertices = faces + len(surface.faces), vertices + len(surface.vertices)
        if faces > MAX_FILE_FACES:
            raise InputError(f"{path} has more than {MAX_FILE_FACES} triangles. Simplify it first.")
        if vertices > MAX_FILE_VERTICES:
            raise InputError(f"{path} has more than {MAX_FILE_VERTICES} vertices. Simplify it first.")
        if len(surface.faces):
            found.append(surface)
    return found
