"""Mesh files of every format give the same surfaces; hostile ones a clear refusal."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from mesh_files import box, glb_box, two_tone, write_glb, write_obj, write_ply, write_stl, write_textured_obj
from PIL import Image

from torc.errors import InputError
from torc.scenes.importing.reading import read_surfaces
from torc.scenes.importing.surfaces import Surface

SIZE = (0.06, 0.16, 0.21)


def _read(path: Path, scale: float = 1.0, y_up: bool = False, textures: bool = True) -> list[Surface]:
    return read_surfaces(path, scale, y_up, path.parent if textures else None, 64)[0]


def _colour_at(surface: Surface, high: bool) -> np.ndarray:
    """The texture's colour at the highest or lowest vertices."""
    assert surface.uv is not None
    assert surface.texture is not None
    z = surface.vertices[:, 2]
    rows = np.flatnonzero(np.isclose(z, z.max() if high else z.min()))
    h, w = surface.texture.shape[:2]
    at = np.clip((surface.uv[rows] * (w, h)).astype(int), 0, (w - 1, h - 1))
    return surface.texture[at[:, 1], at[:, 0]].mean(axis=0)


@pytest.mark.parametrize("format_", ["obj", "stl", "ply"])
def test_every_format_gives_the_same_box(format_: str, tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    write = {"obj": write_obj, "stl": write_stl, "ply": write_ply}[format_]
    (surface,) = _read(write(tmp_path / f"box.{format_}", vertices, faces))
    corners, expected = surface.vertices[surface.faces], vertices[faces]
    order = [np.lexsort(c.reshape(12, -1).round(6).T) for c in (corners, expected)]
    np.testing.assert_allclose(corners[order[0]], expected[order[1]], atol=1e-6)


def test_a_glb_is_y_up_with_its_front_towards_the_robot(tmp_path: Path) -> None:
    path = glb_box(tmp_path / "box.glb", (0.1, 0.2, 0.04))  # width along x, height along y, depth along z
    (surface,) = _read(path, y_up=True)
    np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), (0.04, 0.1, 0.2), atol=1e-6)
    (as_it_is,) = _read(path)
    front = np.isclose(as_it_is.vertices[:, 2], 0.02, atol=1e-6)
    np.testing.assert_allclose(surface.vertices[front, 0], -0.02, atol=1e-6)


def test_scale_is_metres_per_unit(tmp_path: Path) -> None:
    vertices, faces = box((60, 160, 210))
    (surface,) = _read(write_stl(tmp_path / "box.stl", vertices, faces), scale=0.001)
    np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), SIZE, atol=1e-6)


def test_textures_are_not_upside_down(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    uv = np.stack([vertices[:, 1] / SIZE[1] + 0.5, vertices[:, 2] / SIZE[2] + 0.5], axis=1)
    two_tone().save(tmp_path / "paper.png")
    (surface,) = _read(write_textured_obj(tmp_path / "box.obj", vertices, faces, uv, "paper.png"))
    np.testing.assert_allclose(_colour_at(surface, high=True), (220, 0, 0))
    np.testing.assert_allclose(_colour_at(surface, high=False), (0, 0, 220))
    assert surface.rgba == (1.0, 1.0, 1.0, 1.0)
    (surface,) = _read(glb_box(tmp_path / "box.glb", SIZE, two_tone()), y_up=True)
    np.testing.assert_allclose(_colour_at(surface, high=True), (220, 0, 0), atol=3)
    np.testing.assert_allclose(_colour_at(surface, high=False), (0, 0, 220), atol=3)


def test_large_textures_are_scaled_down_and_left_out_on_demand(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    two_tone(300).save(tmp_path / "paper.png")
    path = write_textured_obj(tmp_path / "box.obj", vertices, faces, vertices[:, :2], "paper.png")
    (surface,) = _read(path)
    assert surface.texture is not None
    assert surface.texture.shape == (64, 64, 3)
    (plain,) = _read(path, textures=False)
    assert plain.texture is None


def test_several_materials_stay_several_surfaces(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n")
    vertices, faces = box(SIZE)
    text = "mtllib m.mtl\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in vertices)
    text += "".join(
        f"usemtl {'a' if i < 6 else 'b'}\nf {a + 1} {b + 1} {c + 1}\n" for i, (a, b, c) in enumerate(faces)
    )
    (tmp_path / "box.obj").write_text(text)
    surfaces = _read(tmp_path / "box.obj")
    assert sorted(s.rgba for s in surfaces) == [(0.0, 0.0, 1.0, 1.0), (1.0, 0.0, 0.0, 1.0)]
    assert [len(s.faces) for s in surfaces] == [6, 6]


def test_vertex_colours_are_read(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    colours = (255 * (vertices > 0)).astype(np.uint8)
    (surface,) = _read(write_ply(tmp_path / "box.ply", vertices, faces, colours))
    assert surface.colours is not None
    np.testing.assert_array_equal(surface.colours, 255 * (surface.vertices > 0))


def test_a_missing_material_is_told(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    path = write_obj(tmp_path / "box.obj", vertices, faces, "mtllib gone.mtl")
    surfaces, notes = read_surfaces(path, 1.0, False, tmp_path, 64)
    assert len(surfaces) == 1
    assert notes == ["'gone.mtl' is not there: its colours are missing."]


@pytest.mark.parametrize(
    "name",
    [
        "../secret.mtl",
        "/etc/passwd",
        "C:\\Users\\me\\secret.mtl",
        "file:///etc/passwd",
        "http://localhost/x.mtl",
        "sub/../../secret.mtl",
        "..\\secret.mtl",
        "~/secret.mtl",
        "link.mtl",
    ],
)
def test_materials_outside_of_the_directory_are_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "secret.mtl").write_text("newmtl a\nKd 1 0 0\n")
    inner = tmp_path / "inner"
    (inner / "sub").mkdir(parents=True)
    (inner / "link.mtl").symlink_to(tmp_path / "secret.mtl")
    vertices, faces = box(SIZE)
    path = write_obj(inner / "box.obj", vertices, faces, f"mtllib {name}", "usemtl a")
    with pytest.raises(InputError, match="which is not below"):
        _read(path)
    assert len(_read(path, textures=False)) == 1


def test_textures_outside_of_the_directory_are_refused_unless_it_holds_both(tmp_path: Path) -> None:
    (tmp_path / "textures").mkdir()
    (tmp_path / "meshes").mkdir()
    two_tone().save(tmp_path / "textures" / "paper.png")
    vertices, faces = box(SIZE)
    path = tmp_path / "meshes" / "box.obj"
    write_textured_obj(path, vertices, faces, vertices[:, :2], "../textures/paper.png")
    with pytest.raises(InputError, match=r"paper.png', which is not below"):
        _read(path)
    (surface,), _ = read_surfaces(path, 1.0, False, tmp_path, 64)
    assert surface.texture is not None


@pytest.mark.parametrize(
    "uri", ["other.bin", "../../etc/passwd", "file:///etc/passwd", "http://localhost/a.bin"]
)
@pytest.mark.parametrize("where", ["buffers", "images"])
def test_a_glb_that_points_elsewhere_is_refused(tmp_path: Path, uri: str, where: str) -> None:
    (tmp_path / "other.bin").write_bytes(b"\0" * 100)
    header = {"asset": {"version": "2.0"}, where: [{"uri": uri, "byteLength": 100}]}
    with pytest.raises(InputError, match="points to"):
        _read(write_glb(tmp_path / "a.glb", json.dumps(header)))


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("", "not a readable GLB"),
        ("[" * 100_000, "not a readable GLB"),
        ("[1, 2]", "not a readable GLB"),
        ('{"buffers": 3}', "not a readable GLB"),
        ('{"asset": {"version": "2.0"}}', "not a readable GLB|no triangles"),
        (
            '{"asset": {"version": "2.0"}, "buffers": [{"uri": "data:;base64,####", "byteLength": 4}]}',
            "GLB|no triangles",
        ),
        (
            '{"asset": {"version": "2.0"}, "nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}]}',
            "GLB|no triangles",
        ),
    ],
)
def test_broken_glbs_are_refused(tmp_path: Path, header: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        _read(write_glb(tmp_path / "a.glb", header, b"\0" * 16))


def test_a_compressed_glb_is_refused_with_the_remedy(tmp_path: Path) -> None:
    header = '{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]}'
    with pytest.raises(InputError, match="Export it without compression"):
        _read(write_glb(tmp_path / "a.glb", header))


def test_a_glb_that_claims_more_than_it_has_is_refused(tmp_path: Path) -> None:
    header = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 16}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 4 * 10**9}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 10**8, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    with pytest.raises(InputError):
        _read(write_glb(tmp_path / "a.glb", json.dumps(header), b"\0" * 16))


@pytest.mark.parametrize("format_", ["obj", "stl", "ply", "glb"])
@pytest.mark.parametrize(
    "content", [b"", b"\0" * 500, b"\xff" * 1000, b"nonsense\n" * 50, b"v 1 2\nf 1 2 3\n"]
)
def test_rubbish_is_refused(tmp_path: Path, format_: str, content: bytes) -> None:
    path = tmp_path / f"a.{format_}"
    path.write_bytes(content)
    with pytest.raises(InputError, match=str(path)):
        _read(path)


@pytest.mark.parametrize("format_", ["glb", "obj", "stl", "ply"])
def test_what_is_not_of_the_format_or_cut_off_is_told_as_that(tmp_path: Path, format_: str) -> None:
    path = tmp_path / f"a.{format_}"
    glb = glb_box(tmp_path / "whole.glb", SIZE).read_bytes()
    stl = write_stl(tmp_path / "whole.stl", *box(SIZE)).read_bytes()
    contents = [glb[:-1], stl[:300], b"Only a letter.\nNothing else.\n"]
    contents += [glb] if format_ != "glb" else []
    contents += [stl] if format_ != "stl" else []
    for content in contents:
        path.write_bytes(content)
        with pytest.raises(InputError, match=f"is no {format_.upper()} file, or is cut off"):
            _read(path)


def test_a_solid_in_text_that_is_cut_off_is_not_left_out_unsaid(tmp_path: Path) -> None:
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    whole = "".join(f"solid {name}\n{12 * facet}endsolid {name}\n" for name in "ab")
    path = tmp_path / "two.stl"
    for share in (0.55, 0.7, 0.95):
        path.write_text(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match=r"is no STL file, or is cut off\. Get it again"):
            _read(path)
    path.write_text(whole)
    _read(path)


@pytest.mark.parametrize(
    ("format_", "content"),
    [
        ("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        ("stl", b"solid a\nendsolid a\n"),
        ("stl", b"\0" * 84),
        (
            "ply",
            b"ply\nformat ascii 1.0\nelement vertex 1\n"
            + b"".join(b"property float %c\n" % c for c in b"xyz")
            + b"end_header\n0 0 0\n",
        ),
    ],
)
def test_meshes_without_triangles_are_told_as_that(tmp_path: Path, format_: str, content: bytes) -> None:
    path = tmp_path / f"a.{format_}"
    path.write_bytes(content)
    with pytest.raises(InputError, match="holds no triangles"):
        _read(path)


@pytest.mark.parametrize("format_", ["stl", "ply", "glb"])
@pytest.mark.parametrize("share", [0.05, 0.3, 0.7, 0.95])
def test_truncated_files_are_refused(tmp_path: Path, format_: str, share: float) -> None:
    vertices, faces = box(SIZE)
    path = tmp_path / f"a.{format_}"
    if format_ == "glb":
        glb_box(path, SIZE)
    else:
        {"stl": write_stl, "ply": write_ply}[format_](path, vertices, faces)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=str(path)):
        _read(path)


def test_huge_declared_counts_are_refused(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    with pytest.raises(InputError):
        _read(write_stl(tmp_path / "a.stl", vertices, faces, count=2**32 - 1))
    with pytest.raises(InputError):
        _read(write_ply(tmp_path / "a.ply", vertices, faces, counts="element vertex 4000000000"))
    head = b"ply\nformat binary_little_endian 1.0\nelement vertex 3000000000\nproperty float x\nproperty float y\n"
    head += b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "b.ply").write_bytes(
        head + struct.pack("<9f", *range(9)) + b"\x03" + struct.pack("<3i", 0, 1, 2)
    )
    with pytest.raises(InputError):
        _read(tmp_path / "b.ply")


def test_pictures_that_unpack_to_gigabytes_are_refused(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    path = write_textured_obj(tmp_path / "box.obj", vertices, faces, vertices[:, :2], "bomb.png")
    Image.new("1", (20_000, 10_000)).save(tmp_path / "bomb.png")
    assert (tmp_path / "bomb.png").stat().st_size < 100_000
    with pytest.raises(InputError, match=r"bomb.png. cannot be used"):
        _read(path)


def test_a_glb_with_a_broken_picture_is_refused(tmp_path: Path) -> None:
    path = glb_box(tmp_path / "box.glb", SIZE, two_tone())
    data = path.read_bytes()
    at = data.index(b"\x89PNG")
    path.write_bytes(data[:at] + b"\0" * 8 + data[at + 8 :])
    with pytest.raises(InputError, match="texture cannot be used"):
        _read(path, y_up=True)
    assert _read(path, textures=False)


def test_pictures_of_odd_formats_are_refused(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    path = write_textured_obj(tmp_path / "box.obj", vertices, faces, vertices[:, :2], "page.eps")
    (tmp_path / "page.eps").write_text(
        "%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n%%EndComments\n(x) run\nshowpage\n%%EOF\n"
    )
    with pytest.raises(InputError, match="it is EPS"):
        _read(path)


def test_too_many_parts_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, faces = box(SIZE)
    path = write_stl(tmp_path / "a.stl", vertices, faces)
    monkeypatch.setattr("torc.scenes.importing.reading.reader.MAX_FILE_FACES", 11)
    with pytest.raises(InputError, match="more than 11 triangles"):
        _read(path)
    monkeypatch.setattr("torc.scenes.importing.reading.reader.MAX_FILE_FACES", 12)
    monkeypatch.setattr("torc.scenes.importing.reading.reader.MAX_FILE_VERTICES", 7)
    with pytest.raises(InputError, match="more than 7 vertices"):
        _read(path)
    monkeypatch.setattr("torc.scenes.importing.reading.reader.MAX_PARTS", 0)
    with pytest.raises(InputError, match="more than 0 parts"):
        _read(path)
