"""Mesh files are read as they are meant; what trimesh would read wrongly is refused."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from mesh_files import L_OUTLINE, SIZE, box, edit_glb, prism, textured_box, two_tone, write_obj, write_ply
from PIL import Image

from torc.errors import InputError
from torc.objects.importing.reading import Y_UP, read_surfaces
from torc.objects.importing.surfaces import GRAY, Surface

SQUARE = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)]


def read(path: Path, root: Path | None = None, y_up: bool = False) -> tuple[list[Surface], list[str]]:
    return read_surfaces(path, 1.0, y_up, root or path.parent, 1024)


def mesh_of(surfaces: list[Surface]) -> trimesh.Trimesh:
    """All together, corners welded."""
    mesh = trimesh.util.concatenate([trimesh.Trimesh(s.vertices, s.faces, process=False) for s in surfaces])
    mesh.merge_vertices()
    return mesh


def color_at(surface: Surface, point: np.ndarray) -> tuple[int, ...]:
    """The texture's colour at the vertex that is nearest to a point."""
    assert surface.texture is not None
    assert surface.uv is not None
    u, v = surface.uv[np.linalg.norm(surface.vertices - point, axis=1).argmin()]
    h, w = surface.texture.shape[:2]
    return tuple(surface.texture[min(int(v * h), h - 1), min(int(u * w), w - 1)].tolist())


@pytest.mark.parametrize("name", ["a.obj", "a.glb", "a.stl", "a.ply", "A.PLY"])
def test_every_format_gives_the_solid_back(name: str, tmp_path: Path) -> None:
    box(SIZE).export(tmp_path / name, file_type=name[-3:].lower())
    surfaces, notes = read(tmp_path / name)
    assert notes == []
    mesh = mesh_of(surfaces)
    assert mesh.is_volume
    assert mesh.volume == pytest.approx(np.prod(SIZE), rel=1e-5)
    np.testing.assert_allclose(mesh.extents, SIZE, rtol=1e-5)
    assert {s.rgba for s in surfaces} == {GRAY}


@pytest.mark.parametrize("mirrored", [False, True])
def test_parts_of_a_scene_are_where_its_nodes_put_them(mirrored: bool, tmp_path: Path) -> None:
    scene, T = trimesh.Scene(), trimesh.transformations.rotation_matrix(0.5, (1, 2, 3), (0.1, 0, 0))
    T[:3, :3] *= 2.0
    T[:3, 0] *= -1.0 if mirrored else 1.0
    for matrix in (np.eye(4), T):
        scene.add_geometry(box(SIZE), geom_name="box", transform=matrix)
    scene.export(tmp_path / "a.glb")
    surfaces, _ = read(tmp_path / "a.glb", y_up=True)
    first, second = sorted((mesh_of([s]) for s in surfaces), key=lambda mesh: mesh.area)
    assert first.volume == pytest.approx(np.prod(SIZE), rel=1e-5)
    # Turned inside out, it would be negative.
    assert second.volume == pytest.approx(8 * np.prod(SIZE), rel=1e-5)
    wanted = trimesh.transform_points(box(SIZE).vertices, T) @ Y_UP.T
    np.testing.assert_allclose(second.bounds, (wanted.min(axis=0), wanted.max(axis=0)), atol=1e-6)


@pytest.mark.parametrize("name", ["a.obj", "a.glb"])
def test_a_picture_is_the_right_way_up(name: str, tmp_path: Path) -> None:
    textured_box(SIZE, 2, two_tone(2048), name.endswith("glb")).export(tmp_path / name)
    (surface,), notes = read(tmp_path / name)
    assert notes == []
    assert surface.rgba == (1.0, 1.0, 1.0, 1.0)
    assert surface.texture is not None
    assert surface.texture.shape == (1024, 1024, 3)
    assert color_at(surface, np.array([0, 0, 0.2])) == (220, 0, 0)
    assert color_at(surface, np.array([0, 0, -0.2])) == (0, 0, 220)
    (plain,), _ = read_surfaces(tmp_path / name, 1.0, False, None, 1024)
    assert (plain.texture, plain.rgba) == (None, GRAY)


@pytest.mark.parametrize("name", ["a.ply", "a.obj", "a.glb"])
@pytest.mark.parametrize("of", ["vertices", "faces"])
def test_colors_of_corners_and_triangles_are_kept(name: str, of: str, tmp_path: Path) -> None:
    mesh = box(SIZE)
    mesh.unmerge_vertices()
    top = (mesh.triangles_center if of == "faces" else mesh.vertices)[:, 2:] > 0
    colors = np.where(top, (255, 0, 0, 255), (0, 0, 255, 255)).astype(np.uint8)
    setattr(mesh.visual, "vertex_colors" if of == "vertices" else "face_colors", colors)
    mesh.export(tmp_path / name)
    (surface,), _ = read(tmp_path / name)
    assert surface.colors is not None
    corner = surface.vertices[:, 2] > 0
    if of == "vertices":
        np.testing.assert_array_equal(surface.colors, np.where(corner[:, None], (255, 0, 0), (0, 0, 255)))
    else:
        assert {tuple(c) for c in surface.colors.tolist()} >= {(255, 0, 0), (0, 0, 255)}


def textured(folder: Path, picture: str) -> Path:
    """An OBJ in a folder whose material names a picture."""
    folder.mkdir(parents=True)
    (folder / "a.mtl").write_text(f"newmtl paper\nmap_Kd {picture}\n")
    lines = ["mtllib a.mtl", "usemtl paper", "v 0 0 0", "v 1 0 0", "v 0 0 1", "vt 0 0", "vt 1 0", "vt 0 1"]
    (folder / "a.obj").write_text("\n".join([*lines, "f 1/1 2/2 3/3\n"]))
    return folder / "a.obj"


def test_pictures_are_read_from_the_imported_directory_and_below(tmp_path: Path) -> None:
    two_tone().save(tmp_path / "paper.png")
    path = textured(tmp_path / "meshes" / "box", "..\\..\\paper.png")
    assert read(path, tmp_path)[0][0].texture is not None
    with pytest.raises(InputError, match=r"names '.*paper.png', which is not below .*meshes. Import"):
        read(path, tmp_path / "meshes")
    (path.parent / "link.png").symlink_to(tmp_path / "paper.png")
    for name in (str(tmp_path / "paper.png"), "link.png"):
        (path.parent / "a.mtl").write_text(f"newmtl paper\nmap_Kd {name}\n")
        with pytest.raises(InputError, match="is not below"):
            read(path)


def test_what_is_not_there_or_no_picture_is_told(tmp_path: Path) -> None:
    path = textured(tmp_path / "a", "paper.png")
    assert read(path)[1] == ["'paper.png' is not there: its colours are missing."]
    (path.parent / "a.mtl").unlink()
    assert read(path)[1] == ["'a.mtl' is not there: its colours are missing."]
    whole = path.parent / "paper.png"
    two_tone().save(whole)
    whole.write_bytes(whole.read_bytes()[:-40])
    (path.parent / "a.mtl").write_text("newmtl paper\nmap_Kd paper.png\n")
    with pytest.raises(InputError, match=r"a texture cannot be used .*--no-textures"):
        read(path)
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(whole)
    path.write_text(path.read_text().replace("/1", "").replace("/2", "").replace("/3", ""))
    assert read(path)[1] == ["A texture without coordinates was left out."]


@pytest.mark.parametrize("write", [write_obj, write_ply])
def test_polygons_are_read_where_triangles_from_their_first_corner_make_them(write, tmp_path: Path) -> None:
    path = tmp_path / f"a.{write.__name__[-3:]}"
    hexagon = [(0.05 * np.cos(a), 0.05 * np.sin(a)) for a in np.arange(6) * np.pi / 3]
    straight = [(0.0, 0.0), (0.05, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)]
    notch = [(0.04, 0.04), (0.0, 0.1), (0.0, 0.0), (0.1, 0.0)]  # concave at its first corner
    for outline, area in ((hexagon, 0.0064952), (straight, 0.01), (notch, 0.004), (SQUARE, 0.01)):
        mesh = mesh_of(read(write(path, *prism(outline, 0.05)))[0])
        assert mesh.volume == pytest.approx(0.05 * area, rel=1e-4)
        assert mesh.is_watertight
    fan_fails = L_OUTLINE[1:] + L_OUTLINE[:1]
    for outline in (fan_fails, notch[1:] + notch[:1]):
        with pytest.raises(InputError, match=r"has concave polygons.* Export it triangulated"):
            read(write(path, *prism(outline, 0.05)))
    vertices, polygons = prism(SQUARE, 0.1)
    dart = np.array([(0.05, 0.1, 0.05), (0.055, 0.1, 0.05), (0.051, 0.1, 0.051), (0.05, 0.1, 0.055)])
    read(write(path, np.concatenate([vertices, dart]), [*polygons, [9, 10, 11, 8]]))  # too small to be seen


def test_binary_ply_with_polygons_of_different_numbers_of_corners_is_refused(tmp_path: Path) -> None:
    vertices, polygons = prism(SQUARE, 0.1)
    path = tmp_path / "a.ply"
    for faces in (
        polygons,
        [*polygons[:4], polygons[4][:3], [*polygons[5], polygons[5][0]]],
    ):  # of one length
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
        head += [*(f"property float {axis}" for axis in "xyz"), f"element face {len(faces)}"]
        head += ["property list uchar int vertex_indices", "end_header", ""]
        rows = [struct.pack(f"<B{len(face)}i", len(face), *face) for face in faces]
        path.write_bytes("\n".join(head).encode() + vertices.astype("<f4").tobytes() + b"".join(rows))
        if faces is polygons:
            assert mesh_of(read(path)[0]).volume == pytest.approx(0.001, rel=1e-4)
    with pytest.raises(InputError, match="different numbers of corners"):
        read(path)


def accessor_of(header: dict[str, Any], name: str) -> dict[str, Any]:
    return header["accessors"][header["meshes"][0]["primitives"][0]["attributes"][name]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h: h.update(extensionsRequired=["KHR_draco_mesh_compression"]), "needs KHR_draco"),
        (lambda h: h["nodes"][0].update(skin=0), "skeleton"),
        (lambda h: accessor_of(h, "POSITION").update(componentType=5123, normalized=True), "quantized"),
        (lambda h: accessor_of(h, "COLOR_0").update(componentType=5123, normalized=True), "quantized"),
    ],
)
def test_what_trimesh_misreads_of_glb_is_refused(change, message: str, tmp_path: Path) -> None:
    mesh = box(SIZE)
    mesh.visual.vertex_colors = np.full((len(mesh.vertices), 4), 200, np.uint8)
    mesh.export(tmp_path / "a.glb")
    read(tmp_path / "a.glb")
    with pytest.raises(InputError, match=message):
        read(edit_glb(tmp_path / "a.glb", change))
