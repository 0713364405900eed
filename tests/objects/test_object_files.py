"""Objects on disk: what goes in comes out, and strangers' directories are read without trust."""

import io
import zipfile
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from torc.errors import InputError
from torc.objects.library import builtin_object_names, load_object
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh, pieces_bounds
from torc.objects.object_files import check_model, load_object_directory, load_source, save_object
from torc.objects.schema import ObjectSource

NAMES = ("mug_red", "cracker_box_red", "soup_can_red", "toy_car_blue", "bowl_blue")
"""Between them: every kind of piece that the library has, several surfaces, textures."""


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """The directory of a saved box with a texture."""
    save_object(load_object("cracker_box_red"), tmp_path / "cracker_box_red")
    return tmp_path / "cracker_box_red"


def assert_same(a: ObjectModel, b: ObjectModel) -> None:
    """Numbers, texts and arrays alike."""
    one, other = asdict(a), asdict(b)
    parts = [(one, other), *zip(one.pop("pieces"), other.pop("pieces"), strict=True)]
    parts += zip(one.pop("visuals"), other.pop("visuals"), strict=True)
    for left, right in parts:
        for field, value in left.items():
            np.testing.assert_array_equal(value, right[field])


@pytest.mark.parametrize("name", NAMES)
def test_what_is_saved_comes_back(name: str, tmp_path: Path) -> None:
    save_object(load_object(name), tmp_path / name)
    assert_same(load_object(name), load_object_directory(tmp_path / name))


def test_the_source_is_kept(tmp_path: Path) -> None:
    source = ObjectSource(
        file="mug.obj", note="CC0", scale=0.001, position=(0.1, 0.2, 0.3), wxyz=(0.6, 0.8, 0.0, 0.0)
    )
    save_object(load_object("mug_red"), tmp_path / "mug_red", source)
    assert load_source(tmp_path / "mug_red") == source
    np.testing.assert_allclose(source.T_object_mesh[:3, 3], (0.1, 0.2, 0.3))


def test_a_directory_is_replaced_only_when_told_to(box: Path) -> None:
    with pytest.raises(InputError, match="exists already"):
        save_object(load_object("cracker_box_red"), box)
    (box / "object.yaml").write_text("broken")
    save_object(load_object("cracker_box_red"), box, overwrite=True)
    assert_same(load_object("cracker_box_red"), load_object_directory(box))
    assert [p.name for p in box.parent.iterdir() if p.name != "objects"] == ["cracker_box_red"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("format: torc-object/1", "format: torc-object/2", "format"),
        ("name: cracker_box_red", "name: ../cracker_box_red", "name: must be 1 to 64"),
        ("mass_kg: 0", "mass_kg: -", "mass_kg"),
        ("friction: 0.8", "fricton: 0.8", "not a field"),
        ("texture: texture_0.png", "texture: ../../secret.png", "texture"),
        ("texture: texture_0.png", "texture: texture_9.png", "texture_9.png is missing"),
        ("uv: true", "uv: false", "needs texture coordinates"),
        ("- kind: box", "- kind: sphere", "sphere has 1 sizes"),
        ("wxyz: [1.0", "wxyz: [3.0", "no unit quaternion"),
        ("size_m: [0.", "size_m: [0.1", "size_m is"),
        ("105]\n  position: [0.0", "105]\n  position: [0.1", "centred at"),
    ],
)
def test_faults_of_the_description_are_named(box: Path, old: str, new: str, message: str) -> None:
    path = box / "object.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        load_object_directory(box)


def _replace_arrays(directory: Path, changes: dict[str, bytes]) -> None:
    with zipfile.ZipFile(directory / "geometry.npz") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(directory / "geometry.npz", "w") as archive:
        for name, data in (members | changes).items():
            archive.writestr(name, data)


def _png(width: int, height: int) -> bytes:
    stream = io.BytesIO()
    Image.new("1", (width, height)).save(stream, "PNG")
    return stream.getvalue()


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("key", "content", "message"),
    [
        ("visual_0_vertices.npy", _npy(np.array([[1.0, 2.0, np.nan]])), "not finite"),
        ("visual_0_vertices.npy", _npy(np.array([{"a": 1}], dtype=object)), "allow_pickle=False"),
        ("visual_0_vertices.npy", _npy(np.zeros((3, 2))), "rows of 3"),
        ("visual_0_faces.npy", _npy(np.array([[0, 1, 10**6]])), "points beyond"),
        ("visual_0_uv.npy", _npy(np.zeros((5, 2))), "one row per vertex"),
    ],
)
def test_hostile_arrays_are_refused(box: Path, key: str, content: bytes, message: str) -> None:
    _replace_arrays(box, {key: content})
    with pytest.raises(InputError, match=message):
        load_object_directory(box)


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("geometry.npz", b"PK\x03\x04 and no more", r"not a readable \.npz"),
        ("texture_0.png", _png(4_000, 10), "at most 2048"),
        ("texture_0.png", _png(30_000, 4_000), "no readable picture"),  # Pillow suspects a bomb
        ("texture_0.png", _png(64, 64)[:-40], "no readable picture"),
        ("texture_0.png", b"GIF89a" + b"\0" * 50, "no readable picture"),
    ],
)
def test_hostile_files_are_refused(box: Path, file: str, content: bytes, message: str) -> None:
    (box / file).write_bytes(content)
    with pytest.raises(InputError, match=message):
        load_object_directory(box)


def test_an_object_outside_the_limits_is_not_saved(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="mass_kg"):
        save_object(replace(load_object("mug_red"), mass_kg=500.0), tmp_path / "mug_red")
    assert not (tmp_path / "mug_red").exists()
    assert [p.name for p in tmp_path.iterdir() if p.name != "objects"] == []


WHERE = Path("thing")
TRIANGLE = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])
CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
ONE = np.array([[0, 1, 2]])
PLAIN = VisualMesh(TRIANGLE, ONE)
BOX = CollisionPiece("box", (0.05, 0.05, 0.05))
FAR = CollisionPiece("mesh", (), (-1e6, 0.0, 0.0), vertices=CUBE * 0.02 + (1e6, 0, 0))
"""A cube whose corners are nowhere in single precision."""
DISC = CollisionPiece("cylinder", (0.26, 2e-10), wxyz=(0.8, 0.36, 0.48, 0.0))
SHEET = CollisionPiece("mesh", vertices=CUBE * (0.1, 0.1, 1e-10) + (0, 0, 1.5))


def _object(pieces: list[CollisionPiece], visuals: list[VisualMesh]) -> ObjectModel:
    """Of the lightest kind, its origin where it should be."""
    middle = pieces_bounds(pieces).mean(axis=0)
    moved = tuple(replace(p, position=tuple(np.subtract(p.position, middle).tolist())) for p in pieces)
    lower, upper = pieces_bounds(moved)
    x, y, z = (upper - lower).tolist()
    return ObjectModel("thing", "thing", "the thing", 0.001, moved, tuple(visuals), (x, y, z))


def test_all_that_comes_with_torc_passes() -> None:
    for name in builtin_object_names():
        check_model(load_object(name), WHERE)


@pytest.mark.parametrize(
    ("piece", "told"),
    [(FAR, "lie far from its own"), (SHEET, "flat or degenerate"), (DISC, "flat or degenerate")],
)
def test_pieces_that_the_physics_refuses_are_refused_before(piece: CollisionPiece, told: str) -> None:
    thing = _object([BOX, piece], [PLAIN])
    with pytest.raises(InputError, match=told):
        check_model(thing, WHERE)


@pytest.mark.parametrize("scale", [0.01, 100.0])
def test_the_area_of_all_surfaces_is_bounded(scale: float) -> None:
    """Nothing to be seen, or so much that samples of it would fill the memory."""
    surfaces = [VisualMesh(TRIANGLE * scale, ONE)] * (50 if scale > 1 else 1)
    large = CollisionPiece("box", (0.5, 0.5, 0.5))
    with pytest.raises(InputError, match="m2 in all; it must be 9e-06 to 12"):
        check_model(_object([large], surfaces), WHERE)
