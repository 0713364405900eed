"""What trimesh reads wrongly without a word, looked for beforehand and refused."""

import json
import re
from typing import Any

import numpy as np
from jaxtyping import Float

from torc.errors import InputError

_REMEDY = "Export it triangulated, without compression"
_FLOAT, _UNSIGNED_BYTE = 5126, 5121
_READ_TYPES = {"POSITION": (_FLOAT,), "TEXCOORD_0": (_FLOAT,), "COLOR_0": (_FLOAT, _UNSIGNED_BYTE)}
_READ_EXTENSIONS = re.compile(r"KHR_materials_\w+|KHR_lights_punctual|EXT_texture_webp|KHR_texture_transform")
_OBJ_FACE = re.compile(rb"^f[ ]+(.+)$", re.MULTILINE)
_OBJ_VERTEX = re.compile(rb"^v[ ]+(.+)$", re.MULTILINE)
_FOLD = 0.01
"""Share of the polygons' area that triangles which face the wrong way may cover: modelled things have bent ones."""


def check_glb(data: bytes) -> None:
    """Raises InputError for a GLB with what is not read, or ValueError if it has no readable header."""
    header = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    for extension in header.get("extensionsRequired", ()):
        if not _READ_EXTENSIONS.fullmatch(extension):
            raise _refusal(f"It needs {extension[:80]}")
    if any("skin" in node for node in header.get("nodes", ())):
        raise _refusal("A skeleton bends it (skin)", "Apply the pose and export it without")
    accessors = header.get("accessors", ())
    for part in (part for mesh in header.get("meshes", ()) for part in mesh["primitives"]):
        indices = {"indices": part["indices"]} if "indices" in part else {}
        used = {name: accessors[i] for name, i in (part["attributes"] | indices).items()}
        if any("sparse" in a or "bufferView" not in a for a in used.values()):
            raise _refusal("It has sparse or compressed accessors")
        if any(
            used[name]["componentType"] not in types for name, types in _READ_TYPES.items() if name in used
        ):
            raise _refusal("Its numbers are quantized")


def check_obj(text: bytes) -> None:
    """Raises InputError for an OBJ, tabs replaced, with concave polygons; ValueError for what is no OBJ."""
    faces = [[int(word.split(b"/")[0]) for word in row.split()] for row in _OBJ_FACE.findall(text)]
    vertices = np.array([row.split()[:3] for row in _OBJ_VERTEX.findall(text)], float)
    _check_fans(vertices, [np.array(face) - (np.array(face) > 0) for face in faces])


def check_ply(elements: dict[str, dict[str, Any]]) -> None:
    """Raises InputError for a PLY whose elements, as trimesh read them, are not what they are taken for."""
    if not elements.get("face", {}).get("length"):
        return
    faces = elements["face"]["data"]
    column = faces[next(n for n in ("vertex_index", "vertex_indices") if n in elements["face"]["properties"])]
    if not isinstance(faces, dict):  # binary: all lists were read as if they were as long as the first
        if len(np.unique(column["f0"])) > 1:
            raise _refusal("Its polygons have different numbers of corners")
        column = column["f1"]
    axes = [np.asarray(elements["vertex"]["data"][axis], float).ravel() for axis in "xyz"]
    _check_fans(np.stack(axes, axis=1), list(column))


def _check_fans(vertices: Float[np.ndarray, "n 3"], faces: list[np.ndarray]) -> None:
    """Raises InputError where triangles from polygons' first corners do not make the polygons."""
    whole = folded = 0.0
    for count in {len(face) for face in faces if len(face) > 3}:
        polygons = vertices[np.stack([face for face in faces if len(face) == count]).astype(np.int64)]
        spokes = polygons[:, 1:] - polygons[:, :1]
        triangles = np.cross(spokes[:, :-1], spokes[:, 1:])
        normals = triangles.sum(axis=1)
        area = np.linalg.norm(normals, axis=1)
        facing = np.einsum("ntd,nd->nt", triangles, normals / np.maximum(area, 1e-300)[:, None])
        whole, folded = whole + area.sum(), folded - np.minimum(facing, 0.0).sum()
    if folded > _FOLD * whole:
        raise _refusal("It has concave polygons")


def _refusal(what: str, remedy: str = _REMEDY) -> InputError:
    return InputError(f"{what}, which is not read. {remedy}.")
