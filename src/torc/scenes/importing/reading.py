"""Mesh files to surfaces, by trimesh. Runs in a child process: the files are a stranger's."""

import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from torc.errors import InputError
from torc.scenes.importing.formats import is_format, no_such_format
from torc.scenes.importing.surfaces import GREY, Surface
from torc.scenes.models import Quat

MAX_MESH_BYTES = 200 * 2**20
MAX_FILE_FACES = 3_000_000
MAX_PARTS = 2_000
_MAX_IMAGE_SIDE_PX, _MAX_IMAGE_PIXELS = 16_384, 80_000_000
_IMAGE_FORMATS = {"PNG", "JPEG", "BMP", "TGA", "TIFF", "WEBP", "GIF"}
"""Pillow knows more, some of which start other programs."""
_COMPRESSIONS = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
_BOMBS = (Image.DecompressionBombError, Image.DecompressionBombWarning)
_MAX_SIDE_FILES_BYTES = 300 * 2**20
Y_UP = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""y up and the front towards +z (glTF) to z up and the front towards -x."""


class Neighbours:
    """Hands a mesh's materials and textures to trimesh: plain files below one directory, no others.

    trimesh goes on quietly when one is not to be had, so what was refused or missing is written down here.
    """

    def __init__(self, directory: Path, root: Path) -> None:
        self._directory, self._root, self._left = directory.resolve(), root.resolve(), _MAX_SIDE_FILES_BYTES
        self.refused: list[str] = []
        self.missing: list[str] = []

    def get(self, name: str) -> bytes:
        """The content of a file named in the mesh or its materials. Raises OSError if it is refused or missing."""
        name = str(name).strip().strip('"')
        path = self._inside(name)
        if path is None:
            self.refused.append(f"it names '{name[:120]}', which is not below {self._root}")
            raise OSError(name)
        if not path.is_file():
            self.missing.append(name[:120])
            raise FileNotFoundError(name)
        if path.stat().st_size > self._left:
            self.refused.append(f"with '{name[:120]}' it is more than {_MAX_SIDE_FILES_BYTES // 2**20} MB")
            raise OSError(name)
        data = path.read_bytes()
        self._left -= len(data)
        if path.suffix.lower() != ".mtl":
            self._look_at(data, name)
        return data

    def _look_at(self, data: bytes, name: str) -> None:
        """What trimesh cannot open it leaves out without a word."""
        try:
            with Image.open(io.BytesIO(data)) as image:
                _check_picture(image)
        except (OSError, SyntaxError, ValueError, *_BOMBS) as error:
            self.refused.append(f"its texture '{name[:120]}' cannot be used ({error})")
            raise OSError(name) from error

    def __getitem__(self, name: str) -> bytes:
        return self.get(name)

    def _inside(self, name: str) -> Path | None:
        """Where it is, links followed; None outside of the root."""
        relative = name.replace("\\", "/")
        if not relative or "\0" in relative or ":" in relative or relative.startswith(("/", "~")):
            return None
        try:
            path = (self._directory / relative).resolve()
        except (OSError, RuntimeError, ValueError):
            return None
        return path if path.is_relative_to(self._root) else None


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
    data, kind = path.read_bytes(), path.suffix[1:].lower()
    textured, declared = False, 0
    if kind in ("glb", "stl") and not is_format(data, kind):  # their readers take what is left of a cut one
        raise InputError(f"{path} {no_such_format(data, kind)}")
    if kind == "glb":
        textured = _check_glb(data, path) and root is not None
    elif kind == "ply":
        declared = _ply_faces(data)
    scene, neighbours = _load(data, kind, path, root)
    if neighbours.refused:
        raise InputError(
            f"{path}: {neighbours.refused[0]}. Import the directory that holds both, or put a sound file beside the "
            "mesh and correct the name, or leave materials out (--no-textures)."
        )
    notes = [f"'{name}' is not there: its colours are missing." for name in dict.fromkeys(neighbours.missing)]
    R = scale * (Y_UP if y_up else np.eye(3))
    surfaces, faces = [], 0
    nodes = list(scene.graph.nodes_geometry)
    if len(nodes) > MAX_PARTS:
        raise InputError(
            f"{path} has {len(nodes)} parts; at most {MAX_PARTS}. Join them into one mesh first."
        )
    for node in nodes:
        T, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not hasattr(mesh, "faces") or len(mesh.faces) == 0:
            continue  # points and lines
        faces += len(mesh.faces)
        if faces > MAX_FILE_FACES:
            raise InputError(f"{path} has more than {MAX_FILE_FACES} triangles. Simplify it first.")
        surfaces.append(
            _surface(mesh, np.asarray(T, float), R, root is not None, texture_px, path, linear=kind == "glb")
        )
    if faces < declared:
        raise InputError(f"{path} is cut off: {declared} faces are announced, {faces} are there.")
    if not surfaces:
        why = "holds no triangles." if is_format(data, kind) else no_such_format(data, kind)
        raise InputError(f"{path} {why}")
    if textured and all(s.texture is None for s in surfaces):
        raise InputError(
            f"{path}: its texture cannot be used. Repair it, or leave textures out (--no-textures)."
        )
    return surfaces, notes


def _load(data: bytes, kind: str, path: Path, root: Path | None) -> tuple[Any, Neighbours]:
    import trimesh
    from trimesh.resolvers import Resolver

    neighbours = Neighbours(path.parent, root or path.parent)

    class _Confined(Resolver):
        """trimesh's interface to `Neighbours`."""

        def __init__(self) -> None:
            pass

        def get(self, key: str) -> bytes:
            return neighbours.get(key)

        def write(self, name: str, data: Any) -> None:
            raise OSError("read-only")

        def namespaced(self, namespace: str) -> "_Confined":
            return self

        def keys(self) -> list[str]:
            return []

    options: dict[str, Any] = {} if kind in ("stl", "ply") else {"skip_materials": root is None}
    if kind == "ply":
        options["skip_texture"] = root is None
    try:
        scene = trimesh.load_scene(
            io.BytesIO(data), file_type=kind, resolver=_Confined(), process=False, **options
        )
    except MemoryError:
        raise
    except Exception as error:  # a parser that is not ours, on a file that is not ours: anything may come
        if not is_format(data, kind):
            raise InputError(f"{path} {no_such_format(data, kind)}") from None
        reason = str(error).replace("\n", " ")[:200]
        raise InputError(
            f"{path} is not a readable {kind.upper()} file ({type(error).__name__}: {reason})."
        ) from None
    return scene, neighbours


def _ply_faces(data: bytes) -> int:
    """How many faces the header of a PLY file announces."""
    match = re.search(rb"^element\s+face\s+(\d{1,18})\s*$", data[:10_000], re.MULTILINE)
    return int(match[1]) if match else 0


def _check_glb(data: bytes, path: Path) -> bool:
    """A GLB carries all its data; it may not point anywhere. Returns whether it has a texture of colours."""
    try:
        size = int.from_bytes(data[12:16], "little")
        header = json.loads(data[20 : 20 + size])
        entries = [*header.get("buffers", []), *header.get("images", [])]
        uris = [str(e["uri"]) for e in entries if "uri" in e]
        packed = [name for name in header.get("extensionsRequired", []) if name in _COMPRESSIONS]
    except (ValueError, RecursionError, AttributeError, TypeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not a readable GLB file: {str(error)[:200]}.") from None
    outside = [u for u in uris if not u.startswith("data:")]
    if outside:
        raise InputError(
            f"{path} points to '{outside[0][:80]}'; a GLB must carry its data. Export it again with everything in "
            "one file."
        )
    if packed:
        raise InputError(
            f"{path} is compressed ({packed[0]}), which is not read. Export it without compression."
        )
    return b'"baseColorTexture"' in data[20 : 20 + size]


def _surface(
    mesh: Any, T: np.ndarray, R: np.ndarray, textures: bool, texture_px: int, path: Path, linear: bool
) -> Surface:
    vertices = np.asarray(mesh.vertices, float)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(f"{path}: its vertices do not have three coordinates each.")
    vertices = vertices @ T[:3, :3].T + T[:3, 3]
    faces = np.asarray(mesh.faces, np.int64)
    if np.linalg.det(T[:3, :3]) < 0:
        faces = faces[:, ::-1]
    vertices = vertices @ R.T
    if not textures:
        return Surface(vertices, faces)
    kind = getattr(mesh.visual, "kind", None)
    if kind == "face":
        colours = np.asarray(mesh.visual.face_colors)[:, :3].astype(np.uint8)
        corners = np.arange(3 * len(faces)).reshape(-1, 3)
        return Surface(vertices[faces].reshape(-1, 3), corners, colours=np.repeat(colours, 3, axis=0))
    if kind == "vertex":
        return Surface(vertices, faces, colours=np.asarray(mesh.visual.vertex_colors)[:, :3].astype(np.uint8))
    if kind != "texture":
        return Surface(vertices, faces)
    material, uv = mesh.visual.material, mesh.visual.uv
    rgba, image = _look(material, linear)
    fitting = uv is not None and np.ndim(uv) == 2 and np.shape(uv)[1] >= 2 and len(uv) == len(vertices)
    texture = None if image is None or not fitting else _picture(image, texture_px, path)
    if texture is None:
        return Surface(vertices, faces, rgba=rgba)
    uv = np.asarray(uv, float)[:, :2].copy()
    uv[:, 1] = 1.0 - uv[:, 1]
    uv[~np.isfinite(uv).all(axis=1)] = 0.0
    return Surface(vertices, faces, np.clip(uv, -1e3, 1e3), texture, rgba)


def _look(material: Any, linear: bool) -> tuple[Quat, Any]:
    """Colour and picture of a material. A glTF's colours are linear light, the others' are for the screen."""
    if hasattr(material, "baseColorTexture"):
        image, factor = material.baseColorTexture, material.baseColorFactor
        colour = np.ones(3) if factor is None else _unit_colour(factor)
        if linear:
            colour = np.where(colour <= 0.0031308, 12.92 * colour, 1.055 * colour ** (1 / 2.4) - 0.055)
    else:
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


def _check_picture(image: Image.Image) -> None:
    """Raises ValueError for a picture that is not to be unpacked."""
    if image.format not in _IMAGE_FORMATS:
        raise ValueError(f"it is {image.format or 'of an unknown format'}; PNG and JPEG are read")
    if max(image.size) > _MAX_IMAGE_SIDE_PX or image.width * image.height > _MAX_IMAGE_PIXELS:
        raise ValueError(f"{image.width}x{image.height} pixels are too many")


def _picture(image: Image.Image, texture_px: int, path: Path) -> np.ndarray:
    try:
        _check_picture(image)
        small = image.convert("RGB")
        if max(small.size) > texture_px:
            factor = texture_px / max(small.size)
            size = (max(1, round(factor * small.width)), max(1, round(factor * small.height)))
            small = small.resize(size, Image.Resampling.LANCZOS)
    except (OSError, SyntaxError, ValueError, EOFError) as error:
        raise InputError(
            f"{path}: a texture cannot be used ({error}). Repair it, or leave textures out (--no-textures)."
        ) from None
    return np.asarray(small, np.uint8)
