"""A mesh file becomes an object: geometry, mass, frame, and what was done is told."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import trimesh
from mesh_files import L_OUTLINE, MUG, SIZE, box, prism, revolved, textured_box, two_tone, write_ply

from torc.errors import InputError, MissingDependencyError
from torc.objects.importing import MeshOptions, read_mesh
from torc.objects.importing.making import answer
from torc.objects.models import pieces_bounds
from torc.objects.object_files import load_object_directory, save_object


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child's work is done in this process: no time is lost with starting it."""
    monkeypatch.setattr("torc.objects.importing.mesh.run_child", answer)


def test_a_textured_glb_becomes_an_object(tmp_path: Path) -> None:
    path = tmp_path / "Tea Box.glb"
    textured_box((0.16, 0.21, 0.06), 1, two_tone(), True).export(path)
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
    assert visual.uv is not None
    top = visual.uv[visual.vertices[:, 2].argmax()]
    assert visual.texture[int(top[1] * 63), int(top[0] * 63)].tolist() == [220, 0, 0]
    save_object(model, tmp_path / "tea_box", found.source)
    assert load_object_directory(tmp_path / "tea_box").mass_kg == model.mass_kg


def test_the_source_tells_where_the_meshs_frame_lies(tmp_path: Path, here) -> None:
    """Off-centre, in millimetres, leaning by half a radian, y up: every step of the way is in it."""
    mesh = box((160, 210, 60))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.5, (1, 0, 0)))
    mesh.apply_translation((40, -70, 300))
    mesh.export(tmp_path / "box.obj")
    found = read_mesh(tmp_path / "box.obj", MeshOptions(scale=0.001, up="y"))
    np.testing.assert_allclose(found.model.size_m, SIZE, atol=1e-6)
    assert any("turned by 29 degrees" in note for note in found.notes)
    in_model = trimesh.transform_points(0.001 * mesh.vertices, found.source.T_object_mesh)
    corners = found.model.visuals[0].vertices
    assert np.linalg.norm(in_model[:, None] - corners[None], axis=2).min(axis=1).max() < 1e-6
    lower, upper = pieces_bounds(found.model.pieces)
    np.testing.assert_allclose(lower + upper, 0.0, atol=1e-9)
    as_is = read_mesh(tmp_path / "box.obj", MeshOptions(scale=0.001, up="z", stand=False))
    np.testing.assert_allclose(as_is.source.T_object_mesh[:3, :3], np.eye(3))


@pytest.mark.long
def test_large_colored_meshes_are_simplified(tmp_path: Path, here, monkeypatch) -> None:
    ball = trimesh.creation.icosphere(4, 0.04)
    ball.visual.vertex_colors = np.where(ball.vertices[:, 2:] > 0, (200, 30, 30, 255), (30, 30, 200, 255))
    ball.export(tmp_path / "ball.ply")
    monkeypatch.setattr("torc.objects.importing.making.MAX_FACES", 1500)
    found = read_mesh(tmp_path / "ball.ply")
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


@pytest.fixture
def undecomposed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The shell around an open box takes CoACD a while."""
    monkeypatch.setattr("torc.objects.importing.making.convex_pieces", lambda *_: [])


def test_open_and_damaged_meshes_are_drawn_from_both_sides(tmp_path: Path, here, undecomposed) -> None:
    mesh = box(SIZE)
    vertices = np.concatenate([mesh.vertices, [[np.nan, 0.0, 0.0]]])
    top = mesh.face_normals[:, 2] > 0.5
    path = write_ply(tmp_path / "box.ply", vertices, [*mesh.faces[~top].tolist(), [0, 1, 8]])
    found = read_mesh(path)
    front, back = found.model.visuals
    assert front.normals is not None
    assert back.normals is not None
    np.testing.assert_array_equal(front.normals, -back.normals)
    for word in ("1 unusable triangles", "not watertight", "is its convex hull"):
        assert any(word in note for note in found.notes)


def test_a_mug_is_hollow_and_an_l_has_two_arms(tmp_path: Path, here) -> None:
    mesh = revolved(MUG, 12)
    mesh.export(tmp_path / "mug.stl")
    mug = read_mesh(tmp_path / "mug.stl").model
    assert not any(p.contains(np.array([[0.0, 0.0, 0.01]]))[0] for p in mug.pieces)
    assert sum(p.volume_m3 for p in mug.pieces) == pytest.approx(mesh.volume, rel=0.2)
    vertices, polygons = prism(L_OUTLINE, 0.05)
    path = write_ply(tmp_path / "l.ply", vertices, polygons)
    arms = read_mesh(path, MeshOptions(stand=False)).model
    assert arms.mass_kg == pytest.approx(850 * 0.05 * 0.0051, rel=0.06)  # CoACD is generous


@pytest.mark.parametrize(
    ("size", "options", "message"),
    [
        (SIZE, MeshOptions(scale=1000.0), r"210 m large.*--scale 1 it would be 210 mm"),
        (SIZE, MeshOptions(scale=0.001), r"0\.21 mm large; possible are 6 mm to 1 m.*--scale 0\.1 it"),
        ((60.0, 160.0, 210.0), MeshOptions(), r"With --scale 0\.001 it would be 210 mm"),
        ((0.1, 0.1, 0.001), MeshOptions(), "1 mm thin"),
        ((0.01, 0.01, 0.01), MeshOptions(density_kg_m3=1.0), "would weigh 1e-06 kg"),
    ],
)
def test_absurd_sizes_are_refused_with_a_hint(size, options, message: str, tmp_path: Path, here) -> None:
    box(size).export(tmp_path / "box.stl")
    with pytest.raises(InputError, match=message):
        read_mesh(tmp_path / "box.stl", options)


def test_what_crashes_the_decomposition_gets_its_convex_hull(tmp_path: Path, monkeypatch) -> None:
    def run(request, folder):
        crash = {"ended": "the process ended with code -11"}
        return answer(request, folder) if request["undecomposed"] else crash

    monkeypatch.setattr("torc.objects.importing.mesh.run_child", run)
    revolved(MUG, 12).export(tmp_path / "mug.stl")
    found = read_mesh(tmp_path / "mug.stl")
    assert len(found.model.pieces) == 1
    assert any("convex hull: the decomposition failed (the process ended" in note for note in found.notes)


def test_what_takes_too_much_time_or_memory_is_given_up(tmp_path: Path, monkeypatch) -> None:
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 3000000000\nproperty float x\nend_header\n"
    (tmp_path / "a.ply").write_text(head)
    monkeypatch.setattr("torc.objects.importing.mesh.MEMORY_BYTES", 2**31)
    with pytest.raises(InputError, match=r"a\.ply"):
        read_mesh(tmp_path / "a.ply")
    box(SIZE).export(tmp_path / "a.stl")
    monkeypatch.setattr("torc.objects.importing.mesh.LIMIT_S", 0.05)
    with pytest.raises(InputError, match=r"could not be read: it took longer than"):
        read_mesh(tmp_path / "a.stl")


def test_files_that_are_no_meshes_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.dae").write_text('<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaa">]><x>&a;</x>')
    with pytest.raises(InputError, match="OBJ, GLB, STL, PLY"):
        read_mesh(tmp_path / "a.dae")
    with pytest.raises(InputError, match="There is no mesh file"):
        read_mesh(tmp_path / "none.obj")
    with open(tmp_path / "sparse.stl", "wb") as file:
        file.truncate(201 * 2**20)
    with pytest.raises(InputError, match="too large: 201 MB"):
        read_mesh(tmp_path / "sparse.stl")
    (tmp_path / "茶.stl").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"茶\.stl"):
        read_mesh(tmp_path / "茶.stl")
    with pytest.raises(InputError, match=r"tea\.stl"):
        read_mesh((tmp_path / "茶.stl").rename(tmp_path / "tea.stl"))
    there = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "coacd" else there(name))
    with pytest.raises(MissingDependencyError, match=r"coacd.*scripts/setup import"):
        read_mesh(tmp_path / "tea.stl")


@pytest.mark.parametrize(
    ("option", "value"),
    [("scale", 0.0), ("mass_kg", -1.0), ("density_kg_m3", float("nan")), ("name", "../a")],
)
def test_senseless_options_are_refused(option: str, value: object) -> None:
    with pytest.raises(InputError):
        MeshOptions(**{option: value})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        ("My Box", "my_box"),
        ("_.cup-", "cup"),
        ("x" * 64, "x" * 64),
        ("a" + "-" * 62 + "mug", "mug"),
        ("Tasse für Tee", "tasse_f_r_tee"),
    ],
)
def test_names_are_made_of_file_names(stem: str, name: str) -> None:
    assert MeshOptions().name_for(Path(f"{stem}.obj")) == name


def test_files_named_in_another_script_get_names_of_their_own() -> None:
    files = ["茶.stl", "瓶子.stl", "杯子.obj", "Кружка.obj", "كوب.ply", "!!!.glb"]
    names = [MeshOptions().name_for(Path(f)) for f in files]
    assert len(set(names)) == len(files)
    assert all(name.startswith("object_") and name.isascii() for name in names)
    assert [MeshOptions().name_for(Path(f)) for f in files] == names
    assert MeshOptions().description_for(Path("瓶子.stl")) == "the 瓶子"


def test_notes_are_shortened_and_without_control_characters(tmp_path: Path, monkeypatch) -> None:
    """They hold names from the file."""

    def noisy(request, folder):
        return {**answer(request, folder), "notes": ["\x1b[2Jgone", "x" * 1000, *["more"] * 30]}

    monkeypatch.setattr("torc.objects.importing.mesh.run_child", noisy)
    box(SIZE).export(tmp_path / "box.stl")
    notes = read_mesh(tmp_path / "box.stl").notes
    assert (notes[0], len(notes[1]), len(notes)) == ("?[2Jgone", 300, 20)
