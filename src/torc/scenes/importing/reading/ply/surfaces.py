"""The surfaces of PLY files."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int, Shaped, UInt8

from torc.errors import InputError
from torc.scenes.importing.reading.ply.tables import Lists, PlyError, Table, read_tables
from torc.scenes.importing.reading.polygons import triangulated
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import Surface, coloured, textured

_INDICES = ("vertex_indices", "vertex_index")
_COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_TEXTURE = re.compile(r"TextureFile[\s:]+([^\s:].*)", re.IGNORECASE)
_NO_TEXTURE = _RESTART = -1
_MAX_WHOLE = 2**53
_ROUNDING = 0.01
"""Fractions may be above 1 by this much; colours beyond it are from 0 to 255."""


@dataclass(frozen=True, eq=False)
class _Triangles:
    """The faces as triangles: positions in the list of all the faces' corners, and the face of each.

    `lengths`: how many corners each face has.
    """

    corners: Int[np.ndarray, "c"]
    lengths: Int[np.ndarray, "k"]
    positions: Int[np.ndarray, "m 3"]
    owners: Int[np.ndarray, "m"]


def read_ply(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surfaces of a PLY file: one per texture. See `SurfaceReader`."""
    try:
        tables, comments = read_tables(data)
        tables = _with_faces(tables)
        vertices, triangles = _shape(tables)
        if reading.neighbours is None:
            yield Surface(vertices, triangles.corners[triangles.positions])
            return
        names = [match[1] for match in map(_TEXTURE.match, comments) if match]
        yield from _dressed(vertices, triangles, tables, names, reading)
    except PlyError as error:
        raise InputError(f"{reading.path} is not a readable PLY file: {error}.") from None


def _with_faces(tables: dict[str, Table]) -> dict[str, Table]:
    """The tables, with triangle strips as faces."""
    for name, what in (("face", "faces"), ("tristrips", "triangle strips")):
        if name in tables and _lists(tables[name], _INDICES) is None and _has_rows(tables[name]):
            raise PlyError(
                f"its {what} have no list of {_INDICES[0]}; export it again, with triangles as faces"
            )
    faces, strips = (_lists(tables.get(name), _INDICES) for name in ("face", "tristrips"))
    if strips is None or not len(strips.lengths):
        return tables
    if faces is not None and len(faces.lengths):
        raise PlyError("it holds both faces and triangle strips; write all of it as faces")
    return tables | {"face": Table({}, {}, {_INDICES[0]: _unrolled(strips)})}


def _has_rows(table: Table) -> bool:
    return any(map(len, (*table.columns.values(), *(found.lengths for found in table.lists.values()))))


def _unrolled(strips: Lists) -> Lists:
    """Triangle strips as triangles: every other one is turned, and -1 begins anew."""
    corners = _whole(strips.values, "the number of a corner")
    at = np.arange(len(corners))
    fresh = np.zeros(len(corners), bool)
    fresh[(np.cumsum(strips.lengths) - strips.lengths)[strips.lengths > 0]] = True
    fresh[1:] |= corners[:-1] == _RESTART
    begins = np.maximum.accumulate(np.where(fresh, at, 0))
    first = np.flatnonzero((begins[:-2] == begins[2:]) & (corners[2:] != _RESTART))
    odd = (first - begins[first]) % 2
    triangles = corners[np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]  # those without area join strips
    return Lists(np.full(len(triangles), 3), triangles.reshape(-1))


def _shape(tables: dict[str, Table]) -> tuple[Float[np.ndarray, "n 3"], _Triangles]:
    try:
        columns = tables["vertex"].columns
        vertices = _beside(columns[axis] for axis in "xyz")
    except KeyError:
        raise PlyError("it has no table of vertices with x, y and z") from None
    faces = _lists(tables.get("face"), _INDICES)
    if faces is None:
        faces = Lists(np.zeros(0, np.int64), np.zeros(0))
    corners = _whole(faces.values, "the number of a corner")
    if len(corners) and (corners.min() < 0 or corners.max() >= len(vertices)):
        raise PlyError(f"a face uses a corner beyond the {len(vertices)} vertices")
    return vertices, _Triangles(corners, faces.lengths, *triangulated(vertices, faces.lengths, corners))


def _beside(columns: Iterable[np.ndarray]) -> Float[np.ndarray, "n k"]:
    with np.errstate(invalid="ignore"):  # some that are no numbers warn when they are converted
        return np.stack([column.astype(np.float64) for column in columns], axis=1)


def _whole(values: Shaped[np.ndarray, "n"], what: str) -> Int[np.ndarray, "n"]:
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            whole = (np.abs(values) <= _MAX_WHOLE) & (values == np.floor(values))
        if not whole.all():
            raise PlyError(f"{what} is {values[~whole][0]:g}; whole numbers are read")
    return values.astype(np.int64)


def _lists(table: Table | None, names: tuple[str, ...]) -> Lists | None:
    found = next((table.lists[name] for name in names if name in table.lists), None) if table else None
    return None if found is None else replace(found, lengths=found.lengths.astype(np.int64))


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
        if names:
            reading.note("Its textures are left out: it has no texture coordinates.")
        yield surface
        return
    numbers = _textures(tables.get("face"), triangles, len(names), reading)
    bare = ~np.isfinite(uv[surface.faces]).all(axis=(1, 2)) & (numbers != _NO_TEXTURE)
    if bare.any():
        reading.note("Some of its faces have no texture: their texture coordinates are not complete.")
        numbers[bare] = _NO_TEXTURE
    for number in np.unique(numbers):
        part = replace(surface, faces=surface.faces[numbers == number])
        picture = None if number == _NO_TEXTURE else reading.texture_named(names[number])
        # A texture has the colours of the corners in it.
        white = replace(part, rgba=(1.0, 1.0, 1.0, 1.0), colours=None)
        yield part if picture is None else textured(white, uv * (1.0, -1.0) + (0.0, 1.0), picture)


def _textures(
    faces: Table | None, triangles: _Triangles, count: int, reading: Reading
) -> Int[np.ndarray, "m"]:
    """Which texture each triangle has."""
    named = None if faces is None else faces.columns.get("texnumber")
    if named is None:
        if count > 1:
            reading.note(f"It has {count} textures and does not say where: the first is used throughout.")
        return np.zeros(len(triangles.owners), np.int64)
    numbers = _whole(named, "the number of a texture")[triangles.owners]
    beyond = (numbers < _NO_TEXTURE) | (numbers >= count)
    if beyond.any():
        reading.note(f"Some of its faces have no texture: they name others than the {count} of the file.")
    elif (numbers == _NO_TEXTURE).all():
        reading.note("Its textures are left out: none of its faces names one.")
    return np.where(beyond, _NO_TEXTURE, numbers)


def _colours(table: Table | None) -> UInt8[np.ndarray, "n 3"] | None:
    """Colours of a table's rows: whole numbers of 8 or 16 bits, or fractions, which some write from 0 to 255."""
    names = next((n for n in _COLOURS if table and set(n) <= table.columns.keys()), None)
    if table is None or names is None:
        return None
    values = _beside(table.columns[name] for name in names)
    fractions = np.array([table.kinds[name] in ("f4", "f8") for name in names])
    scales = np.array([65535.0 if table.kinds[name] == "u2" else 255.0 for name in names])
    written = values[:, fractions]
    if written.max(initial=0.0, where=np.isfinite(written)) <= 1.0 + _ROUNDING:
        scales[fractions] = 1.0
    return np.round(255 * np.clip(np.nan_to_num(values) / scales, 0.0, 1.0)).astype(np.uint8)


def _wedges(faces: Table | None, triangles: _Triangles) -> Float[np.ndarray, "k 2"] | None:
    """Texture coordinates of the triangles' corners, v up, where the faces have their own: nan at faces without."""
    lists = _lists(faces, ("texcoord",))
    if lists is None:
        return None
    complete = lists.lengths == 2 * triangles.lengths
    if not (complete & (triangles.lengths > 0)).any():
        return None
    uv = np.full((len(triangles.corners), 2), np.nan)
    values = lists.values[np.repeat(complete, lists.lengths)]
    uv[np.repeat(complete, triangles.lengths)] = _beside(values.reshape(-1, 2).T)
    return uv[triangles.positions].reshape(-1, 2)


def _coordinates(table: Table) -> Float[np.ndarray, "n 2"] | None:
    """Texture coordinates of the vertices, v up."""
    names = next((n for n in _COORDINATES if set(n) <= table.columns.keys()), None)
    if names is None:
        return None
    return _beside(table.columns[name] for name in names)
