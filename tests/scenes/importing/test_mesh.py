"""A mesh file becomes an object: geometry, mass, frame, and what was done is told."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from glb_files import GlbBuilder
from mesh_files import L_OUTLINE, box, glb_box, prism, revolved, two_tone, write_obj, write_ply, write_stl

from torc.errors import InputError, MissingDependencyError
from torc.scenes.importing import MeshOptions, import_mesh, read_mesh
from torc.scenes.models import pieces_bounds
from torc.scenes.object_files import load_object_directory, save_object

SIZE = (0.06, 0.16, 0.21)


def test_a_textured_glb_becomes_an_object(tmp_path: Path) -> None:
    path = glb_box(tmp_path / "Tea Box.glb", (0.16, 0.21, 0.06), two_tone())
    found = read_mesh(path)
    model = found.model
    assert (model.name, model.kind, model.description) == ("tea_box", "tea_box", "the tea box")
    np.testing.assert_allclose(model.size_m, SIZE, atol=1e-6)
    (piece,) = model.pieces
    assert piece.volume_m3 == pytest.approx(np.prod(SIZE), rel=1e-5)
    assert model.mass_kg == pytest.approx(850 * np.prod(SIZE), rel=1e-5)
    assert (model.rolls, model.held_out, found.notes) == (False, True, ())
    (visual,) = model.visuals
    assert visual.texture is not None
    save_object(model, tmp_path / "tea_box", found.source)
    assert load_object_directory(tmp_path / "tea_box").mass_kg == model.mass_kg


def test_the_source_tells_where_the_meshs_frame_lies(tmp_path: Path) -> None:
    """Off-centre, in millimetres, leaning by half a radian, y up: every step of the way is in it."""
    vertices, faces = box((160, 210, 60))
    lean = 0.5
    R = np.array([[1, 0, 0], [0, np.cos(lean), -np.sin(lean)], [0, np.sin(lean), np.cos(lean)]])
    moved = vertices @ R.T + (40, -70, 300)
    found = read_mesh(write_obj(tmp_path / "box.obj", moved, faces), MeshOptions(scale=0.001, up="y"))
    np.testing.assert_allclose(found.model.size_m, SIZE, atol=1e-6)
    assert any("turned by 29 degrees" in note for note in found.notes)
    T = found.source.T_object_mesh
    in_model = 0.001 * moved @ T[:3, :3].T + T[:3, 3]
    corners = found.model.visuals[0].vertices
    nearest = np.linalg.norm(in_model[:, None] - corners[None], axis=2).min(axis=1)
    assert nearest.max() < 1e-6
    lower, upper = pieces_bounds(found.model.pieces)
    np.testing.assert_allclose(lower + upper, 0.0, atol=1e-9)
    as_is = read_mesh(tmp_path / "box.obj", MeshOptions(scale=0.001, up="z", stand=False))
    np.testing.assert_allclose(as_is.source.T_object_mesh[:3, :3], np.eye(3))


PLUS = [(1, 0), (2, 0), (2, 1), (3, 1), (3, 2), (2, 2), (2, 3), (1, 3), (1, 2), (0, 2), (0, 1), (1, 1)]


@pytest.mark.parametrize(
    ("outline", "shadow_m2", "steps"),
    [
        ([(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)], 0.01, 1),
        ([(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)], 0.01, 5),
        (L_OUTLINE, 0.0051, 3),
        ([(0.03 * x, 0.03 * y) for x, y in PLUS], 0.0045, 1),
        ([(0.03 * x, 0.03 * y) for x, y in PLUS], 0.0045, 4),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_corners_along_an_edge_leave_a_solid_closed(
    outline: list[tuple[float, float]], shadow_m2: float, steps: int, turned: bool, tmp_path: Path
) -> None:
    """Polygons beside a subdivided edge have straight corners; their triangles must leave no gap there."""
    ends = [*outline[1:], outline[0]]
    fine = [
        (a[0] + (b[0] - a[0]) * k / steps, a[1] + (b[1] - a[1]) * k / steps)
        for a, b in zip(outline, ends)
        for k in range(steps)
    ]
    vertices, polygons = prism(fine, 0.05)
    if turned:
        vertices = vertices @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
        if np.linalg.det(np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]) < 0:
            polygons = [p[::-1] for p in polygons]
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in polygon) for polygon in polygons]
    (tmp_path / "prism.obj").write_text("\n".join(lines) + "\n")
    found = read_mesh(tmp_path / "prism.obj", MeshOptions(stand=False))
    assert found.notes == ()
    assert found.model.mass_kg == pytest.approx(850 * 0.05 * shadow_m2, rel=0.06)  # CoACD is generous


def test_options_are_taken(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    path = write_stl(tmp_path / "box.stl", vertices, faces)
    options = MeshOptions(
        name="n", kind="k", description="the thing", mass_kg=0.3, friction=0.5, rolls=True, textures=False
    )
    model = import_mesh(path, options)
    assert (model.name, model.kind, model.description) == ("n", "k", "the thing")
    assert (model.mass_kg, model.friction, model.rolls) == (0.3, 0.5, True)


@pytest.mark.parametrize(
    ("offset", "options", "told"),
    [
        ((0.0, 0.0, 0.105), MeshOptions(), True),  # stands on z = 0
        ((0.0, 0.105, 0.0), MeshOptions(), False),  # on y = 0, as it should
        ((0.0, 0.0, 0.0), MeshOptions(), False),  # about 0: nobody can tell
        ((0.0, 0.0, 0.105), MeshOptions(up="z"), False),
        ((0.0, 0.0, 0.105), MeshOptions(up="y"), False),
    ],
)
def test_a_glb_that_stands_on_z_is_told_of(
    offset: tuple[float, float, float], options: MeshOptions, told: bool, tmp_path: Path
) -> None:
    path = GlbBuilder().shape(box((0.06, 0.21, 0.21))[0] + offset, box(SIZE)[1]).write(tmp_path / "tower.glb")
    notes = read_mesh(path, options).notes
    assert any("--up z" in note for note in notes) == told


def test_large_coloured_meshes_are_simplified(tmp_path: Path) -> None:
    angles = np.linspace(-np.pi / 2, np.pi / 2, 60)[1:-1]
    vertices, faces = revolved(
        [(0.0, -0.04), *zip(0.04 * np.cos(angles), 0.04 * np.sin(angles)), (0.0, 0.04)], 60
    )
    colours = np.where(vertices[:, 2:] > 0, (200, 30, 30), (30, 30, 200)).astype(np.uint8)
    path = write_ply(tmp_path / "ball.ply", vertices, faces, colours)
    found = read_mesh(path, MeshOptions(max_faces=1500))
    (visual,) = found.model.visuals
    assert len(visual.faces) <= 1500
    assert visual.texture is not None
    assert {tuple(c) for c in visual.texture.reshape(-1, 3)} >= {(200, 30, 30), (30, 30, 200)}
    assert found.model.rolls
    (piece,) = found.model.pieces
    assert len(piece.mesh_vertices) <= 160
    # A ball with so many corners lies on a facet, and is that much lower.
    np.testing.assert_allclose(found.model.size_m, 0.08, atol=0.0015)
    assert any("simplified" in note for note in found.notes)


def test_open_and_damaged_meshes_are_drawn_from_both_sides(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    vertices = np.concatenate([vertices, [[np.nan, 0.0, 0.0]]])
    faces = np.concatenate([faces[:-1], [[0, 1, 8]]])
    # The shell around an open box takes CoACD a while; it is not what is looked at here.
    found = read_mesh(write_ply(tmp_path / "box.ply", vertices, faces), MeshOptions(decompose_limit_s=0.05))
    assert len(found.model.visuals) == 2
    front, back = found.model.visuals
    assert front.normals is not None
    assert back.normals is not None
    np.testing.assert_array_equal(front.normals, -back.normals)
    assert any("unusable" in note for note in found.notes)


def test_the_convex_hull_stands_in_when_decomposition_takes_too_long(tmp_path: Path) -> None:
    vertices, faces = revolved(
        [(0.0, 0.0), (0.05, 0.0), (0.05, 0.01), (0.01, 0.01), (0.01, 0.08), (0.0, 0.08)]
    )
    path = write_stl(tmp_path / "stool.stl", vertices, faces)
    found = read_mesh(path, MeshOptions(decompose_limit_s=0.05))
    assert len(found.model.pieces) == 1
    assert any("is its convex hull" in note and "longer than" in note for note in found.notes)


def test_the_same_file_gives_the_same_object(tmp_path: Path) -> None:
    path = glb_box(tmp_path / "box.glb", SIZE, two_tone())
    for folder in ("a", "b"):
        save_object(import_mesh(path), tmp_path / folder / "box")
    for file in (tmp_path / "a" / "box").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / "box" / file.name).read_bytes()


@pytest.mark.parametrize(
    ("scale", "message"),
    [
        (1000.0, r"210 m large.*--scale 1\."),
        (0.001, r"0.21 mm large.*--scale 0.1"),
    ],
)
def test_absurd_sizes_are_refused_with_a_hint(scale: float, message: str, tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    with pytest.raises(InputError, match=message):
        import_mesh(write_stl(tmp_path / "box.stl", vertices, faces), MeshOptions(scale=scale))


def test_sheets_and_feathers_are_refused(tmp_path: Path) -> None:
    vertices, faces = box((0.1, 0.1, 0.001))
    with pytest.raises(InputError, match="1 mm thin"):
        import_mesh(write_stl(tmp_path / "a.stl", vertices, faces))
    vertices, faces = box((0.01, 0.01, 0.01))
    with pytest.raises(InputError, match="would weigh 1e-06 kg"):
        import_mesh(write_stl(tmp_path / "a.stl", vertices, faces), MeshOptions(density_kg_m3=1.0))


def test_a_file_that_takes_too_long_is_given_up(tmp_path: Path) -> None:
    vertices, faces = box(SIZE)
    with pytest.raises(InputError, match=r"could not be read: it took longer than"):
        import_mesh(write_stl(tmp_path / "a.stl", vertices, faces), MeshOptions(read_limit_s=0.05))


def test_a_file_that_needs_too_much_memory_is_given_up(tmp_path: Path) -> None:
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 3000000000\nproperty float x\nend_header\n"
    (tmp_path / "a.ply").write_text(head)
    with pytest.raises(InputError, match=r"a\.ply"):
        import_mesh(tmp_path / "a.ply", MeshOptions(memory_bytes=2**30))


def test_files_that_are_no_meshes_are_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "a.dae").write_text('<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaa">]><x>&a;</x>')
    with pytest.raises(InputError, match="OBJ, GLB, STL, PLY"):
        import_mesh(tmp_path / "a.dae")
    with pytest.raises(InputError, match="There is no mesh file"):
        import_mesh(tmp_path / "none.obj")
    with open(tmp_path / "sparse.stl", "wb") as file:
        file.truncate(201 * 2**20)
    with pytest.raises(InputError, match="too large: 201 MB"):
        import_mesh(tmp_path / "sparse.stl")
    vertices, faces = box(SIZE)
    with pytest.raises(InputError, match="No name can be made"):
        import_mesh(write_stl(tmp_path / "茶.stl", vertices, faces))


def test_a_missing_library_is_told_with_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "coacd" else there(name))
    with pytest.raises(MissingDependencyError, match=r"coacd.*scripts/setup import"):
        import_mesh(tmp_path / "a.stl")


@pytest.mark.parametrize(
    "options",
    [
        {"scale": 0.0},
        {"scale": float("nan")},
        {"mass_kg": -1.0},
        {"density_kg_m3": 0.0},
        {"friction": 100.0},
        {"max_faces": 0},
        {"max_pieces": 1000},
        {"concavity": 0.0},
        {"up": "x"},
        {"name": "../a"},
        {"kind": ""},
    ],
)
def test_senseless_options_are_refused(options: dict[str, object]) -> None:
    with pytest.raises(InputError):
        MeshOptions(**options)  # type: ignore[arg-type]


def test_parts_that_the_physics_takes_for_lines_are_left_out(tmp_path: Path) -> None:
    """Besides a box, a triangle of 10 cm by 2 nm of another material."""
    vertices, faces = box(SIZE)
    corners = np.concatenate([vertices, [(0, 0, 0), (0.1, 0, 0), (0, 2e-9, 0)]])
    path = write_obj(tmp_path / "box.obj", corners, faces)
    path.write_text(f"mtllib box.mtl\nusemtl a\n{path.read_text()}usemtl b\nf 9 10 11\n")
    (tmp_path / "box.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n")
    found = read_mesh(path)
    assert "Parts that are but points or lines were left out (1)." in found.notes
    assert [v.rgba[:3] for v in found.model.visuals] == [(1.0, 0.0, 0.0)]
    save_object(found.model, tmp_path / "box", found.source)
