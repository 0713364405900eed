"""The surfaces of OBJ and STL files, by trimesh."""

import contextlib
import io
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from torc.errors import InputError
from torc.scenes.importing.reading.obj_text import PlainObj, plain_obj
from torc.scenes.importing.reading.pictures import Neighbours, picture
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import GREY, Surface, coloured, textured
from torc.scenes.models import Quat


def read_obj(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surfaces of an OBJ file. See `SurfaceReader`."""
    try:
        plain = plain_obj(data)
    except (ValueError, IndexError) as error:
        raise _unreadable("obj", reading, error) from None
    files = _resolver(reading.neighbours, plain)
    return _surfaces(plain.text, "obj", reading, resolver=files, skip_materials=reading.neighbours is None)


def read_stl(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surfaces of an STL file. See `SurfaceReader`."""
    return _surfaces(data, "stl", reading)


def _surfaces(data: bytes, kind: str, reading: Reading, **options: Any) -> Iterator[Surface]:
    import trimesh

    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **options)
    except MemoryError:
        raise
    except Exception as error:  # a parser that is not ours, on a file that is not ours: anything may come
        raise _unreadable(kind, reading, error) from None
    for mesh in scene.geometry.values():
        if len(getattr(mesh, "faces", ())):  # the rest are points and lines
            yield _surface(mesh, reading)


def _resolver(neighbours: Neighbours | None, obj: PlainObj) -> Any:
    """trimesh's interface to the files that an OBJ names."""
    from trimesh.resolvers import Resolver

    class _Confined(Resolver):
        def __init__(self) -> None:
            pass

        def get(self, key: str) -> bytes:
            if neighbours is None:
                raise FileNotFoundError(key)
            if key != obj.LIBRARY:
                return neighbours.get(key)
            found = []
            for name in obj.libraries:
                with contextlib.suppress(OSError):  # it is written down what was missing or refused
                    found.append(neighbours.get(name))
            return b"\n".join(found)

        def write(self, name: str, data: Any) -> None:
            raise OSError("read-only")

        def namespaced(self, namespace: str) -> "_Confined":
            return self

        def keys(self) -> list[str]:
            return []

    return _Confined()


def _unreadable(kind: str, reading: Reading, error: Exception) -> InputError:
    reason = str(error).replace("\n", " ")[:200]
    return InputError(
        f"{reading.path} is not a readable {kind.upper()} file ({type(error).__name__}: {reason})."
    )


def _surface(mesh: Any, reading: Reading) -> Surface:
    vertices = np.asarray(mesh.vertices, float)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(f"{reading.path}: its vertices do not have three coordinates each.")
    surface = Surface(vertices, np.asarray(mesh.faces, np.int64))
    kind = getattr(mesh.visual, "kind", None)
    if reading.neighbours is None or kind is None:
        return surface
    if kind == "vertex":
        return coloured(surface, np.asarray(mesh.visual.vertex_colors)[:, :3].astype(np.uint8))
    if kind != "texture":
        return surface
    rgba, image = _look(mesh.visual.material)
    surface, uv = replace(surface, rgba=rgba), mesh.visual.uv
    if image is None or np.ndim(uv) != 2 or np.shape(uv)[1] < 2 or len(uv) != len(vertices):
        return surface
    uv = np.asarray(uv, float)[:, :2] * (1.0, -1.0) + (0.0, 1.0)  # v points up in the file
    return textured(surface, uv, picture(image, reading.texture_px, reading.path))


def _look(material: Any) -> tuple[Quat, Any]:
    """Colour and picture of a material."""
    image = getattr(material, "image", None)
    if image is not None and image.format is None:
        image = None  # trimesh's own, where the file names none
    # Many exporters write a grey colour beside a picture and do not mean it.
    colour = np.ones(3) if image is not None else _unit_colour(getattr(material, "diffuse", None))
    r, g, b = (float(c) for c in np.clip(colour, 0.0, 1.0))
    return (r, g, b, 1.0), image


def _unit_colour(value: Any) -> np.ndarray:
    """Three numbers from 0 to 1; the colour of plain meshes where there are none."""
    colour = np.asarray(GREY[:3] if value is None else value)
    if colour.ndim != 1 or len(colour) < 3:
        return np.array(GREY[:3])
    unit = colour[:3].astype(float) / (255.0 if colour.dtype.kind in "iu" else 1.0)
    return np.asarray(np.nan_to_num(unit, nan=0.7))
