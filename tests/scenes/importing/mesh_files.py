"""Mesh files for the tests, written by hand where the format is plain."""

import io
import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image

CORNERS = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]) - 0.5
BOX_FACES = np.array(
    [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]
)  # fmt: skip
"""Counter-clockwise seen from outside; the last two are the top, those before them the bottom."""


def box(size: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a box about the origin."""
    return CORNERS * size, BOX_FACES.copy()


def revolved(profile: list[tuple[float, float]], sections: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """A surface of revolution about z: (radius, z) points from the lower pole outwards and up; poles have radius 0."""
    t = 2 * np.pi * np.arange(sections) / sections
    vertices, rings = [], []
    for r, z in profile:
        count = 1 if r == 0 else sections
        rings.append(len(vertices) + np.arange(count))
        vertices += [(r * np.cos(a), r * np.sin(a), z) for a in t[:count]]
    faces = []
    for low, high in pairwise(rings):
        for i in range(sections):
            a, b = low[i % len(low)], low[(i + 1) % len(low)]
            c, d = high[i % len(high)], high[(i + 1) % len(high)]
            faces += [f for f in ((a, b, d), (a, d, c)) if len(set(f)) == 3]
    return np.array(vertices), np.array(faces)


MUG = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.09), (0.035, 0.09), (0.035, 0.006), (0.0, 0.006)]
"""Profile of a mug without handle."""


def write_obj(path: Path, vertices: np.ndarray, faces: np.ndarray, head: str = "", tail: str = "") -> Path:
    lines = [head, *(f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()), tail]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_textured_obj(
    path: Path, vertices: np.ndarray, faces: np.ndarray, uv: np.ndarray, image: str
) -> Path:
    """One texture coordinate (v up) per vertex, and the material that names the image."""
    path.with_suffix(".mtl").write_text(f"newmtl paper\nKd 0.8 0.8 0.8\nmap_Kd {image}\n")
    lines = [f"mtllib {path.stem}.mtl"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in uv.tolist()]
    lines += ["usemtl paper", *(f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in (faces + 1).tolist())]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_stl(path: Path, vertices: np.ndarray, faces: np.ndarray, count: int | None = None) -> Path:
    """Binary; `count`: what the header says, if not the truth."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *vertices[face].ravel().tolist(), 0) for face in faces)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(faces) if count is None else count) + body)
    return path


def write_ply(
    path: Path, vertices: np.ndarray, faces: np.ndarray, colours: np.ndarray | None = None, counts: str = ""
) -> Path:
    """Text; `counts`: another line in place of the number of vertices."""
    head = ["ply", "format ascii 1.0", counts or f"element vertex {len(vertices)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    if colours is not None:
        head += [f"property uchar {c}" for c in ("red", "green", "blue")]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(repr, row)) for row in vertices.tolist()]
    if colours is not None:
        rows = [f"{row} {' '.join(map(str, c))}" for row, c in zip(rows, colours.tolist())]
    rows += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


def write_glb(path: Path, header: str, data: bytes = b"") -> Path:
    """A GLB of any header, right or wrong."""
    text = header.encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if data:
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    return path


def glb_box(path: Path, size: tuple[float, float, float], image: Image.Image | None = None) -> Path:
    """A GLB box, y up as its standard has it: size is (width, height, depth). The image's top is at the top."""
    import trimesh
    from trimesh.visual.material import PBRMaterial
    from trimesh.visual.texture import TextureVisuals

    vertices, faces = box(size)
    vertices, faces = vertices[faces].reshape(-1, 3), np.arange(36).reshape(-1, 3)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if image is not None:
        uv = np.stack([vertices[:, 0] / size[0] + 0.5, vertices[:, 1] / size[1] + 0.5], axis=1)
        mesh.visual = TextureVisuals(uv=uv, material=PBRMaterial(baseColorTexture=image))
    mesh.export(path)
    return path


def two_tone(size: int = 64) -> Image.Image:
    """Red above, blue below."""
    pixels = np.zeros((size, size, 3), np.uint8)
    pixels[: size // 2, :, 0] = 220
    pixels[size // 2 :, :, 2] = 220
    return Image.fromarray(pixels)


def png(image: Image.Image) -> bytes:
    """A picture's file."""
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


L_OUTLINE = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.1), (0.0, 0.1)]
"""A concave polygon, counter-clockwise, of .0051 m2."""


def prism(outline: list[tuple[float, float]], height: float) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices and polygons of an upright prism: bottom, top, sides."""
    n = len(outline)
    vertices = np.array([(*p, z) for z in (0.0, height) for p in outline])
    sides = [[i, (i + 1) % n, (i + 1) % n + n, i + n] for i in range(n)]
    return vertices, [list(range(n))[::-1], list(range(n, 2 * n)), *sides]


def enclosed_volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Of a closed surface."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Of all triangles: polygons that are fanned out wrongly overlap, which adds to it."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
