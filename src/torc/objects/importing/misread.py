"""What trimesh reads wrongly without a word, looked for beforehand and refused."""

import json
import re
from typing import Any

import numpy as np
from jaxtyping import Float

from torc.errors import InputError

_REMEDY = "Export it triangulated, without compression"
_FLOAT, _UNSIGNED_BYTE = 5126, 5121
_FAN_MODE = 6
_READ_EXTENSIONS = re.compile(r"KHR_materials_\w+|KHR_lights_punctual|EXT_texture_webp|KHR_texture_transform")
_UNSEEN_EXTENSIONS = {"EXT_mesh_gpu_instancing", "KHR_node_visibility"}
_OBJ_FACE = re.compile(rb"^f[ ]+(.+)$", re.MULTILINE)
_OBJ_VERTEX = re.compile(rb"^v[ ]+(.+)$", re.MULTILINE)
_OBJ_LIBRARY = re.compile(rb"^mtllib[ ]+(.+)$", re.MULTILINE)
_PLAIN_COORDINATES = {"texCoord": 0, "offset": [0, 0], "rotation": 0, "scale": [1, 1]}
_FOLD = 0.01
"""Share of the polygons' area that triangles which face the wrong way may cover: modelled things have bent ones."""


def check_glb(data: bytes, textures: bool) -> None:
    """Raises InputError for a GLB with what is not read, or ValueError if it has no readable header."""
    header = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    needed = [e for e in header.get("extensionsRequired", ()) if not _READ_EXTENSIONS.fullmatch(e)]
    needed += sorted(_UNSEEN_EXTENSIONS.intersection(header.get("extensionsUsed", ())))
    if needed:
        raise _refusal(f"It needs {needed[0][:80]}")
    nodes, meshes = header.get("nodes", ()), header.get("meshes", ())
    if any("skin" in node for node in nodes):
        raise _refusal("A skeleton bends it (skin)", "Apply the pose and export it without")
    if any(any(part.get("weights", ())) for part in (*nodes, *meshes)):
        raise _refusal("A shape key bends it (weights)", "Apply the shape keys")
    for part in (part for mesh in meshes for part in mesh["primitives"]):
        if part.get("mode") == _FAN_MODE:
            raise _refusal("It has fans of triangles")
        used = {name: header["accessors"][i] for name, i in part["attributes"].items()}
        if "indices" in part:
            used["indices"] = header["accessors"][part["indices"]]
        _check_accessors(used)
    if textures:
        for material in header.get("materials", ()):
            _check_coordinates(material)


def _check_accessors(used: dict[str, dict[str, Any]]) -> None:
    if any("sparse" in a or "bufferView" not in a for a in used.values()):
        raise _refusal("It has sparse or compressed accessors")
    allowed = {"POSITION": (_FLOAT,), "TEXCOORD_0": (_FLOAT,), "COLOR_0": (_FLOAT, _UNSIGNED_BYTE)}
    if any(used[name]["componentType"] not in types for name, types in allowed.items() if name in used):
        raise _refusal("Its numbers are quantized")


def _check_coordinates(material: dict[str, Any]) -> None:
    """Raises InputError for a base colour texture that lies elsewhere than the plain coordinates say."""
    info = material.get("pbrMetallicRoughness", {}).get("baseColorTexture", {})
    transform = info.get("extensions", {}).get("KHR_texture_transform", {})
    if {**_PLAIN_COORDINATES, "texCoord": info.get("texCoord", 0), **transform} != _PLAIN_COORDINATES:
        raise _refusal(
            "A texture has coordinates of its own (texCoord, KHR_texture_transform)",
            "Bake them, or leave textures out (--no-textures)",
        )


def check_obj(text: bytes, textures: bool) -> None:
    """Raises InputError for an OBJ, tabs replaced, with what is not read; ValueError for what is no OBJ."""
    if textures and len({name.strip() for name in _OBJ_LIBRARY.findall(text)}) > 1:
        raise _refusal("It names several material libraries", "Join them, or leave them out (--no-textures)")
    polygons: dict[int, list[list[int]]] = {}
    backwards = False
    for row in _OBJ_FACE.findall(text):
        corners = [int(word.split(b"/")[0]) for word in row.split()]
        if len(corners) < 3 or 0 in corners:
            raise InputError("It has faces without corners. Export it again.")
        backwards = backwards or min(corners) < 0
        if len(corners) > 3:
            polygons.setdefault(len(corners), []).append([i - (i > 0) for i in corners])
    if backwards and text.rfind(b"\nv") > text.find(b"\nf "):
        raise _refusal("It counts corners backwards from its faces")
    if polygons:
        vertices = np.array([row.split()[:3] for row in _OBJ_VERTEX.findall(text)], float)
        _check_fans([vertices[np.array(alike)] for alike in polygons.values()])


def check_ply(elements: dict[str, dict[str, Any]]) -> None:
    """Raises InputError for a PLY whose elements, as trimesh read them, are cut off or not what they are taken for."""
    for name, element in elements.items():
        data = element.get("data")
        rows = len(next(iter(data.values()))) if isinstance(data, dict) else 0 if data is None else len(data)
        if rows != element["length"]:
            raise InputError(f"It is cut off: {rows} of {element['length']} rows of '{name}'. Get it again.")
    if not elements.get("face", {}).get("length"):
        return
    faces = elements["face"]["data"]
    column = faces[next(n for n in ("vertex_index", "vertex_indices") if n in elements["face"]["properties"])]
    if not isinstance(faces, dict):  # binary: all lists were read as if they were as long as the first
        if len(np.unique(column["f0"])) > 1:
            raise _refusal("Its polygons have different numbers of corners")
        column = column["f1"]
    vertices = np.stack(
        [np.asarray(elements["vertex"]["data"][axis], float).ravel() for axis in "xyz"], axis=1
    )
    lengths = np.array([len(polygon) for polygon in column])
    alike = [np.stack(column[lengths == n]).astype(np.int64) for n in set(lengths[lengths > 3].tolist())]
    _check_fans([vertices[polygons] for polygons in alike])


def _check_fans(groups: list[Float[np.ndarray, "n k 3"]]) -> None:
    """Raises InputError where triangles from polygons' first corners do not make the polygons."""
    whole = folded = 0.0
    for polygons in groups:
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
