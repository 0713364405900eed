"""The surfaces of PLY files."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int, UInt8

from torc.errors import InputError
from torc.scenes.importing.reading.pictures import picture_of
from torc.scenes.importing.reading.ply_tables import Lists, PlyError, Table, read_tables
from torc.scenes.importing.reading.polygons import triangulated
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import Surface, coloured, textured

_INDICES = ("vertex_indices", "vertex_index")
_COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_TEXTURE = re.compile(r"TextureFile\s+(.*\S)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class _Triangles:
    """The faces as triangles: positions in the list of all the faces' corners, and the face of each."""

    corners: Int[np.ndarray, "c"]
    positions: Int[np.ndarray, "m 3"]
    owners: Int[np.ndarray, "m"]


def read_ply(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surfaces of a PLY file: one per texture. See `SurfaceReader`."""
    try:
        tables, comments = read_tables(data)
        vertices, triangles = _shape(tables)
        if reading.neighbours is None:
            yield Surface(vertices, triangles.corners[triangles.positions])
            return
        names = [match[1] for match in map(_TEXTURE.match, comments) if match]
        yield from _dressed(vertices, triangles, tables, names, reading)
    except PlyError as error:
        raise InputError(f"{reading.path} is not a readable PLY file: {error}.") from None


def _shape(tables: dict[str, Table]) -> tuple[Float[np.ndarray, "n 3"], _Triangles]:
    try:
        columns = tables["vertex"].columns
        vertices = np.stack([columns[axis].astype(np.float64) for axis in "xyz"], axis=1)
    except KeyError:
        raise PlyError("it has no table of vertices with x, y and z") from None
    faces = _lists(tables.get("face"), _INDICES)
    if faces is None:
        return vertices, _Triangles(*(np.zeros(n, np.int64) for n in (0, (0, 3), 0)))
    corners = faces.values.astype(np.int64)
    if len(corners) and (corners.min() < 0 or corners.max() >= len(vertices)):
        raise PlyError(f"a face uses a corner beyond the {len(vertices)} vertices")
    return vertices, _Triangles(corners, *triangulated(vertices, faces.lengths, corners))


def _lists(table: Table | None, names: tuple[str, ...]) -> Lists | None:
    return next((table.lists[name] for name in names if name in table.lists), None) if table else None


def _dressed(
    vertices: Float[np.ndarray, "n 3"],
    triangles: _Triangles,
    tables: dict[str, Table],
    names: list[str],
    reading: Reading,
) -> Iterator[Surface]:
    corners = triangles.corners[triangles.positions]
    by_face, by_vertex = _colours(tables.get("face")), _colours(tables["vertex"])
    uv, wedges = _coordinates(tables["vertex"]), _wedges(tables.get("face"), triangles)
    surface = Surface(vertices, corners)
    if by_face is not None or wedges is not None:  # every triangle gets corners of its own
        surface = Surface(vertices[corners].reshape(-1, 3), np.arange(corners.size).reshape(-1, 3))
        by_vertex = None if by_vertex is None else by_vertex[corners].reshape(-1, 3)
        uv = None if uv is None else uv[corners].reshape(-1, 2)
    uv = uv if wedges is None else wedges
    colours = by_vertex if by_face is None else np.repeat(by_face[triangles.owners], 3, axis=0)
    if colours is not None:
        surface = coloured(surface, colours)
    if not names or uv is None:
        yield surface
        return
    which = tables["face"].columns.get("texnumber") if wedges is not None else None
    numbers = np.zeros(len(corners), np.int64) if which is None else which[triangles.owners].astype(np.int64)
    for number in np.unique(numbers):
        part = replace(surface, faces=surface.faces[numbers == number])
        picture = _picture(names[number], reading) if 0 <= number < len(names) else None
        white = replace(part, rgba=(1.0, 1.0, 1.0, 1.0)) if colours is None else part
        yield part if picture is None else textured(white, uv * (1.0, -1.0) + (0.0, 1.0), picture)


def _picture(name: str, reading: Reading) -> UInt8[np.ndarray, "h w 3"] | None:
    """A texture; None if the file is missing or refused, which is written down."""
    if reading.neighbours is None:
        return None
    try:
        return picture_of(reading.neighbours.get(name), reading.texture_px, reading.path)
    except OSError:
        return None


def _colours(table: Table | None) -> UInt8[np.ndarray, "n 3"] | None:
    """Colours of a table's rows: whole numbers of 8 or 16 bits, or fractions."""
    names = next((n for n in _COLOURS if table and set(n) <= table.columns.keys()), None)
    if table is None or names is None:
        return None
    most = {"u1": 255.0, "u2": 65535.0, "f4": 1.0, "f8": 1.0}
    scales = [most.get(table.kinds[name], 255.0) for name in names]
    units = np.stack([table.columns[name] / scale for name, scale in zip(names, scales)], axis=1)
    return np.round(255 * np.clip(np.nan_to_num(units), 0.0, 1.0)).astype(np.uint8)


def _wedges(faces: Table | None, triangles: _Triangles) -> Float[np.ndarray, "k 2"] | None:
    """Texture coordinates of the triangles' corners, v up, where the faces have their own."""
    lists = _lists(faces, ("texcoord",))
    if lists is None or len(lists.values) != 2 * len(triangles.corners):
        return None
    return lists.values.reshape(-1, 2).astype(np.float64)[triangles.positions].reshape(-1, 2)


def _coordinates(table: Table) -> Float[np.ndarray, "n 2"] | None:
    """Texture coordinates of the vertices, v up."""
    names = next((n for n in _COORDINATES if set(n) <= table.columns.keys()), None)
    if names is None:
        return None
    return np.stack([table.columns[name].astype(np.float64) for name in names], axis=1)
