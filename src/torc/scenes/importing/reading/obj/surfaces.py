"""The surfaces of OBJ files."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

from torc.errors import InputError
from torc.scenes.importing.reading.neighbours import Neighbours
from torc.scenes.importing.reading.obj.materials import Material, find_material, read_materials
from torc.scenes.importing.reading.obj.tables import ObjError, ObjTables, read_obj_tables
from torc.scenes.importing.reading.polygons import triangulated
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import GREY, Surface, coloured, textured
from torc.scenes.models import Quat


def read_obj(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surfaces of an OBJ file, one per material. See `SurfaceReader`."""
    try:
        tables = read_obj_tables(data)
    except ObjError as error:
        raise InputError(f"{reading.path} is not a readable OBJ file: {error}.") from None
    positions, owners = triangulated(tables.vertices, tables.lengths, tables.corners)
    if reading.neighbours is None:
        yield Surface(tables.vertices, tables.corners[positions])
        return
    materials = _materials(tables, reading, reading.neighbours)
    of_triangle = tables.materials[owners]
    order = np.argsort(of_triangle, kind="stable")
    starts = np.searchsorted(of_triangle[order], np.arange(-1, len(tables.names) + 1))
    for index, first, end in zip(range(-1, len(tables.names)), starts, starts[1:]):
        if first < end:
            material = None if index < 0 else find_material(materials, tables.names[index])
            yield from _dressed(tables, positions[order[first:end]], material, reading)


def _materials(tables: ObjTables, reading: Reading, neighbours: Neighbours) -> dict[bytes, Material]:
    texts = map(neighbours.read, tables.libraries)
    materials = read_materials(text for text in texts if text is not None)
    lost = [
        name.decode("utf-8", "replace")[:40]
        for name in tables.names
        if name and find_material(materials, name) is None
    ]
    if lost and not neighbours.missing:
        where = "its library" if tables.libraries else "a library, for it names none"
        reading.note(
            f"{len(lost)} materials are not in {where}: their colours are missing ({', '.join(lost[:3])})."
        )
    return materials


def _dressed(
    tables: ObjTables, positions: Int[np.ndarray, "m 3"], material: Material | None, reading: Reading
) -> Iterator[Surface]:
    """The triangles of one material; those without texture coordinates apart, if it has a texture."""
    named = None if material is None else material.texture
    picture = None if named is None else reading.texture_named(named)
    if material is None or picture is None:
        yield _plain(tables, positions, _rgba(material))
        return
    with_wedges = (tables.wedges[positions] >= 0).all(axis=1)
    if not with_wedges.all():
        reading.note("Faces without texture coordinates are shown without their texture.")
        yield _plain(tables, positions[~with_wedges], _rgba(material))
    if with_wedges.any():
        some = positions[with_wedges]
        pairs = np.stack([tables.corners[some], tables.wedges[some]], axis=-1).reshape(-1, 2)
        pairs, faces = np.unique(pairs, axis=0, return_inverse=True)
        # White: many exporters write a grey colour beside a picture and do not mean it.
        surface = Surface(tables.vertices[pairs[:, 0]], faces.reshape(-1, 3), rgba=(1.0, 1.0, 1.0, 1.0))
        uv = tables.coordinates[pairs[:, 1]] * material.scale + material.offset
        yield textured(surface, uv * (1.0, -1.0) + (0.0, 1.0), picture)  # v points up in the file


def _rgba(material: Material | None) -> Quat:
    return GREY if material is None or material.colour is None else (*material.colour, 1.0)


def _plain(tables: ObjTables, positions: Int[np.ndarray, "m 3"], rgba: Quat) -> Surface:
    used, faces = np.unique(tables.corners[positions], return_inverse=True)
    return _with_colours(Surface(tables.vertices[used], faces.reshape(-1, 3), rgba=rgba), tables, used, rgba)


def _with_colours(surface: Surface, tables: ObjTables, rows: Int[np.ndarray, "n"], rgba: Quat) -> Surface:
    """The surface with its corners' colours, where some have any."""
    colours: Float[np.ndarray, "n 3"] | None = None if tables.colours is None else tables.colours[rows]
    if colours is None or (np.isnan(colours) | (colours == 1.0)).all():
        return surface  # none, or a layer of colours that nobody painted on
    return coloured(surface, np.round(255 * np.where(np.isnan(colours), rgba[:3], colours)).astype(np.uint8))
