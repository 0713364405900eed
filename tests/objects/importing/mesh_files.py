"""Mesh files for the tests."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.creation import box, revolve
from trimesh.visual.material import PBRMaterial, SimpleMaterial
from trimesh.visual.texture import TextureVisuals

SIZE = (0.06, 0.16, 0.21)
MUG = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.09), (0.035, 0.09), (0.035, 0.006), (0.0, 0.006)]
"""Profile of a mug without handle."""
L_OUTLINE = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.1), (0.0, 0.1)]
"""A concave polygon, counter-clockwise, of .0051 m2; triangles from its first corner make it, from its second not."""


def revolved(profile: list[tuple[float, float]], sections: int = 24) -> trimesh.Trimesh:
    """A surface of revolution about z: (radius, z) points."""
    return revolve(np.array(profile), sections=sections)


def prism(outline: list[tuple[float, float]], height: float) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices and polygons of an upright prism: bottom, top, sides."""
    n = len(outline)
    vertices = np.array([(*p, z) for z in (0.0, height) for p in outline])
    sides = [[i, (i + 1) % n, (i + 1) % n + n, i + n] for i in range(n)]
    return vertices, [[0, *range(n - 1, 0, -1)], list(range(n, 2 * n)), *sides]


def write_obj(path: Path, vertices: np.ndarray, polygons: list[list[int]]) -> Path:
    """Polygons of any number of corners."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices).tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in polygon) for polygon in polygons]
    path.write_text("\n".join(lines) + "\n")
    return path


def two_tone(size: int = 64) -> Image.Image:
    """Red above, blue below."""
    pixels = np.zeros((size, size, 3), np.uint8)
    pixels[: size // 2, :, 0] = 220
    pixels[size // 2 :, :, 2] = 220
    return Image.fromarray(pixels)


def textured_box(size: tuple[float, float, float], up: int, image: Image.Image, pbr: bool) -> trimesh.Trimesh:
    """A box whose picture's top is at the top, which is along axis `up`."""
    mesh = box(size)
    mesh.unmerge_vertices()
    uv = mesh.vertices[:, [0, up]] / (size[0], size[up]) + 0.5
    material = PBRMaterial(baseColorTexture=image) if pbr else SimpleMaterial(image=image)
    mesh.visual = TextureVisuals(uv=uv, material=material)
    return mesh


def edit_glb(path: Path, change: Any) -> Path:
    """Rewrites the header of a GLB: `change` is given it to alter."""
    data = path.read_bytes()
    end = 20 + int.from_bytes(data[12:16], "little")
    header = json.loads(data[20:end])
    change(header)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + data[end:]
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body)
    return path


def write_ply(path: Path, vertices: np.ndarray, polygons: list[list[int]]) -> Path:
    """Polygons of any number of corners, in text."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    head += [*(f"property double {axis}" for axis in "xyz"), f"element face {len(polygons)}"]
    rows = [" ".join(map(repr, row)) for row in np.asarray(vertices).tolist()]
    rows += [" ".join(map(str, (len(p), *p))) for p in polygons]
    path.write_text("\n".join([*head, "property list uchar int vertex_indices", "end_header", *rows]) + "\n")
    return path
