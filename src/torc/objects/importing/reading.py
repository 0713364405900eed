"""Read mesh files as surfaces, by trimesh. Runs in a child process: the files are a stranger's."""

import io
import json
import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float, UInt8
from PIL import Image
from trimesh.resolvers import FilePathResolver

from torc.errors import InputError
from torc.objects.importing.surfaces import Surface

Y_UP = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""From y up and the front towards +z (glTF) to z up and the front towards -x."""
_MAX_NOTES = 20
_SEE_THROUGH = ("BLEND", "MASK")
_READ_EXTENSIONS = re.compile(r"KHR_materials_\w+|KHR_lights_punctual|EXT_texture_webp|KHR_texture_transform")
_FLOAT, _UNSIGNED_BYTE = 5126, 5121
_READ_TYPES = {"POSITION": (_FLOAT,), "TEXCOORD_0": (_FLOAT,), "COLOR_0": (_FLOAT, _UNSIGNED_BYTE)}
"""Types of numbers in glTF; trimesh takes normalized integers at their face value."""
_OBJ_FACE = re.compile(rb"^f[ ]+(.+)$", re.MULTILINE)
_OBJ_VERTEX = re.compile(rb"^v[ ]+(.+)$", re.MULTILINE)
_FOLD = 0.01
"""Largest share of the polygons' area that triangles facing the wrong way may cover: modelled things have bent ones."""


def read_surfaces(
    path: Path, scale: float, y_up: bool, root: Path | None, texture_px: int
) -> tuple[list[Surface], list[str]]:
    """Return the surfaces in a mesh file (`scale` metres per unit), metres, z up; and notes for the user.

    Materials and textures, at most `texture_px` long, are read from `root` and below; None: no colours at all. Raises
    InputError for a file without triangles, misread by trimesh, or that names files which it may not read. For other
    files trimesh may raise anything.
    """
    neighbours = Neighbours(path, root or path.parent)
    try:
        scene = _load(path, neighbours, root is not None)
    except InputError as error:
        raise InputError(
            f"{path}: {error} Export it triangulated, without compression and skeleton."
        ) from None
    if neighbours.refused:
        raise InputError(
            f"{path} names '{neighbours.refused[0][:120]}', which is not below {neighbours.root}. Import the directory "
            "that holds both, or put the file beside the mesh and correct the name, or leave materials out "
            "(--no-textures)."
        )
    notes = [f"'{name[:120]}' is not there: its colours are missing." for name in neighbours.missing]
    dressed = {
        name: _plain(mesh) if root is None else _dressed(mesh, path, texture_px, notes)
        for name, mesh in scene.geometry.items()
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)
    }
    R = scale * (Y_UP if y_up else np.eye(3))
    placements = (scene.graph[node] for node in scene.graph.nodes_geometry)
    surfaces = [_placed(dressed[name], R @ T[:3]) for T, name in placements if name in dressed]
    if not surfaces:
        raise InputError(f"{path} holds no triangles.")
    return surfaces, list(dict.fromkeys(notes))[:_MAX_NOTES]


class Neighbours(FilePathResolver):
    """The files that a mesh names, below one directory.

    trimesh continues without files that it cannot get; what was refused or missing is recorded here.
    """

    def __init__(self, path: Path, root: Path) -> None:
        super().__init__(str(path))
        self.root, self.refused, self.missing = root.resolve(), list[str](), list[str]()

    def get(self, name: str) -> bytes:
        path = (Path(self.parent) / name.strip().strip('"').replace("\\", "/")).resolve()
        if not path.is_relative_to(self.root):
            self.refused.append(name)
        elif not path.is_file():
            self.missing.append(name)
        else:
            return path.read_bytes()
        raise FileNotFoundError(name)


def _load(path: Path, neighbours: Neighbours, textures: bool) -> trimesh.Scene:
    """Load a file by trimesh. Raises InputError for what it would read wrongly."""
    data, kind = path.read_bytes(), path.suffix[1:].lower()
    if kind == "obj":
        data = data.replace(b"\t", b" ").replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ")
        faces = [[int(word.split(b"/")[0]) for word in row.split()] for row in _OBJ_FACE.findall(data)]
        vertices = np.array([row.split()[:3] for row in _OBJ_VERTEX.findall(data)], float)
        _check_fans(vertices, [np.array(face) - (np.array(face) > 0) for face in faces])
    if kind == "glb":
        header = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
        for extension in header.get("extensionsRequired", ()):
            if not _READ_EXTENSIONS.fullmatch(extension):
                raise InputError(f"It needs {extension[:80]}, which is not read.")
        if any("skin" in node for node in header.get("nodes", ())):
            raise InputError("A skeleton bends it (skin), which is not read.")
        for part in (part for mesh in header.get("meshes", ()) for part in mesh["primitives"]):
            for name, types in _READ_TYPES.items():
                accessor = part["attributes"].get(name)
                if accessor is not None and header["accessors"][accessor]["componentType"] not in types:
                    raise InputError("Its numbers are quantized, which is not read.")
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # numpy's, for text that it reads only partly
        # "process" would join corners of different colours
        scene = trimesh.load_scene(
            io.BytesIO(data), kind, neighbours, process=False, skip_materials=not textures
        )
    for elements in (mesh.metadata["_ply_raw"] for mesh in scene.geometry.values() if kind == "ply"):
        if elements.get("face", {}).get("length"):
            rows, known = elements["face"]["data"], elements["face"]["properties"]
            polygons = rows[next(name for name in ("vertex_index", "vertex_indices") if name in known)]
            if not isinstance(rows, dict):  # binary: all lists were read as if they were as long as the first
                if len(np.unique(polygons["f0"])) > 1:
                    raise InputError("Its polygons have different numbers of corners, which is not read.")
                polygons = polygons["f1"]
            axes = [np.asarray(elements["vertex"]["data"][axis], float).ravel() for axis in "xyz"]
            _check_fans(np.stack(axes, axis=1), list(polygons))
    return scene


def _placed(surface: Surface, T: Float[np.ndarray, "3 4"]) -> Surface:
    """Move the surface by an affine transform; if that mirrors it, flip its triangles."""
    with np.errstate(invalid="ignore", over="ignore"):  # vertices that are not finite are left out
        vertices = surface.vertices @ T[:, :3].T + T[:, 3]
    turn = -1 if np.linalg.det(T[:, :3]) < 0 else 1
    return replace(surface, vertices=vertices, faces=surface.faces[:, ::turn])


def _plain(mesh: trimesh.Trimesh) -> Surface:
    return Surface(np.array(mesh.vertices), np.array(mesh.faces))


def _dressed(mesh: trimesh.Trimesh, path: Path, texture_px: int, notes: list[str]) -> Surface:
    """Return a mesh with its material, texture, or colours of corners or triangles."""
    visual: Any = mesh.visual
    surface, is_glb = _plain(mesh), path.suffix.lower() == ".glb"
    image = factor = colors = None
    if visual.kind == "vertex":
        colors = visual.vertex_colors
    elif visual.kind == "face":  # every triangle gets its own corners
        corners = surface.vertices[surface.faces].reshape(-1, 3)
        surface = Surface(corners, np.arange(len(corners)).reshape(-1, 3))
        colors = np.repeat(visual.face_colors, 3, axis=0)
    elif visual.kind == "texture" and is_glb:
        image, factor = visual.material.baseColorTexture, visual.material.baseColorFactor
        factor = (255, 255, 255) if factor is None else factor
        colors = visual.vertex_attributes.get("color")
        if visual.material.alphaMode in _SEE_THROUGH:
            notes.append("Transparent parts are shown opaque.")
    elif visual.kind == "texture":
        image, colors = visual.material.image, mesh.vertex_attributes.get("color")
        if image is None:
            factor = visual.material.diffuse
        elif image.format is None:  # without a material, trimesh paints a picture
            image = None
        else:  # many exporters write an unintended grey colour beside a picture
            factor, colors = (255, 255, 255), None
    tints = None if factor is None else np.array(factor)[None, :3] / 255
    if colors is not None and len(colors) == len(surface.vertices):
        shares = np.array(colors)[:, :3] / (1 if colors.dtype.kind == "f" else 255)
        tints = shares * tints if is_glb and tints is not None else shares
    if tints is not None:
        surface = _tinted(surface, tints, is_glb)
    if image is None:
        return surface
    if visual.uv is None or len(visual.uv) != len(surface.vertices):
        notes.append("A texture without coordinates was left out.")
        return surface
    uv = np.clip(np.nan_to_num(np.array(visual.uv)), -1e3, 1e3) * (1.0, -1.0) + (0.0, 1.0)  # v down
    return replace(surface, uv=uv, texture=_picture(image, path, texture_px))


def _tinted(surface: Surface, tints: Float[np.ndarray, "k 3"], is_linear: bool) -> Surface:
    """Return the surface with one colour, or one per vertex, 0 to 1; linear in glTF (2.0, section 3.9.2)."""
    tints = np.clip(np.nan_to_num(tints), 0.0, 1.0)
    if is_linear:  # to the values of sRGB (IEC 61966-2-1)
        bright = 1.055 * np.maximum(tints, 0.0031308) ** (1 / 2.4) - 0.055
        tints = np.where(tints <= 0.0031308, 12.92 * tints, bright).round(9)
    if (tints == tints[0]).all():
        r, g, b = (float(c) for c in tints[0])
        return replace(surface, rgba=(r, g, b, 1.0))
    return replace(surface, colors=np.round(255 * tints).astype(np.uint8))


def _picture(image: Image.Image, path: Path, texture_px: int) -> UInt8[np.ndarray, "h w 3"]:
    try:
        colors = image.convert("RGB")
    except (OSError, SyntaxError, ValueError) as error:
        raise InputError(
            f"{path}: a texture cannot be used ({error}). Repair it, or leave textures out (--no-textures)."
        ) from None
    colors.thumbnail((texture_px, texture_px), Image.Resampling.LANCZOS)
    return np.asarray(colors, np.uint8)


def _check_fans(vertices: Float[np.ndarray, "n 3"], faces: list[np.ndarray]) -> None:
    """Raise InputError if triangles from polygons' first corners do not make the polygons."""
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
        raise InputError("It has concave polygons, which are not read.")
