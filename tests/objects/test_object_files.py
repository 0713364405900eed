"""Objects on disk: what goes in comes out, and strangers' directories are read without trust."""

import io
import os
import shutil
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from torc.errors import InputError
from torc.objects.files import ObjectSource, load_object_directory, load_source, save_object
from torc.objects.library import load_object
from torc.objects.models import ObjectModel

NAMES = ("mug_red", "cracker_box_red", "soup_can_red", "toy_car_blue", "bowl_blue")
"""Between them: every kind of piece that the library has, several surfaces, textures."""


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """The directory of a saved box with a texture."""
    save_object(load_object("cracker_box_red"), tmp_path / "cracker_box_red")
    return tmp_path / "cracker_box_red"


@pytest.fixture
def bowl(tmp_path: Path) -> Path:
    """The directory of a saved object with mesh pieces."""
    save_object(load_object("bowl_blue"), tmp_path / "bowl_blue")
    return tmp_path / "bowl_blue"


def assert_same(a: ObjectModel, b: ObjectModel) -> None:
    for field in ("name", "kind", "description", "mass_kg", "size_m", "rolls", "friction", "held_out"):
        assert getattr(a, field) == getattr(b, field)
    assert len(a.pieces) == len(b.pieces)
    for p, q in zip(a.pieces, b.pieces):
        assert (p.kind, p.size, p.position, p.wxyz) == (q.kind, q.size, q.position, q.wxyz)
        assert p.relative_density == q.relative_density
        _assert_equal(p.vertices, q.vertices)
    assert len(a.visuals) == len(b.visuals)
    for v, w in zip(a.visuals, b.visuals):
        assert v.rgba == pytest.approx(w.rgba)
        for field in ("vertices", "faces", "uv", "normals", "texture"):
            _assert_equal(getattr(v, field), getattr(w, field))


def _assert_equal(a: np.ndarray | None, b: np.ndarray | None) -> None:
    assert (a is None) == (b is None)
    if a is not None and b is not None:
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_saved_comes_back(name: str, tmp_path: Path) -> None:
    save_object(load_object(name), tmp_path / name)
    assert_same(load_object(name), load_object_directory(tmp_path / name))


def test_the_same_object_gives_the_same_bytes(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        save_object(load_object("mug_red"), tmp_path / folder / "mug_red")
    for file in (tmp_path / "a" / "mug_red").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / "mug_red" / file.name).read_bytes()


def test_the_source_is_kept(tmp_path: Path) -> None:
    source = ObjectSource("mug.obj", "CC0", 0.001, (0.1, 0.2, 0.3), (0.6, 0.8, 0.0, 0.0))
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


def test_a_name_that_differs_from_the_directory_is_refused(box: Path) -> None:
    with pytest.raises(InputError, match="bears its name"):
        save_object(load_object("mug_red"), box.parent / "mug")
    box.rename(box.parent / "other")
    with pytest.raises(InputError, match="Give both one name"):
        load_object_directory(box.parent / "other")


def test_nothing_is_left_where_it_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="Cannot write"):
        save_object(load_object("mug_red"), tmp_path / "file" / "mug_red")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("format: torc-object/1", "format: torc-object/2", "format"),
        ("name: cracker_box_red", "name: ../cracker_box_red", "name: must be 1 to 64"),
        ("kind: cracker_box", "kind: a/b", "kind: must be 1 to 64"),
        ("mass_kg: 0", "mass_kg: -", "mass_kg"),
        ("mass_kg: 0", "mass_kg: 1e9 #", "mass_kg"),
        ("mass_kg: 0", "mass_kg: .nan #", "mass_kg"),
        ("friction: 0.8", "friction: 99", "friction"),
        ("friction: 0.8", "friction: true", "friction: must be a number, not true or false"),
        ("wxyz: [1.0", "wxyz: [true", r"wxyz\[0\]: must be a number, not true or false"),
        ("friction: 0.8", "fricton: 0.8", "not a field"),
        ("rolls: false", "rolls: false\nrolls: true", "given 2 times"),
        ("description: ", 'description: "\\e[2J" #', "cannot be printed"),
        ("texture: texture_0.png", "texture: ../../secret.png", "texture"),
        ("texture: texture_0.png", "texture: /etc/passwd", "texture"),
        ("texture: texture_0.png", "texture: texture_9.png", "texture_9.png is missing"),
        ("uv: true", "uv: false", "needs texture coordinates"),
        ("normals: true", "normals: false", "not expected"),
        ("- kind: box", "- kind: cone", "kind"),
        ("- kind: box", "- kind: sphere", "sphere has 1 sizes"),
        ("relative_density: 1.0", "relative_density: 0", "relative_density"),
        ("wxyz: [1.0", "wxyz: [3.0", "no unit quaternion"),
    ],
)
def test_faults_of_the_description_are_named(box: Path, old: str, new: str, message: str) -> None:
    path = box / "object.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        load_object_directory(box)


def test_the_frame_and_size_must_be_those_of_the_pieces(box: Path) -> None:
    path = box / "object.yaml"
    text = path.read_text()
    before, pieces = text.split("pieces:")
    path.write_text(f"{before}pieces:{pieces.replace('position: [0.0', 'position: [0.1')}")
    with pytest.raises(InputError, match="centred at"):
        load_object_directory(box)
    path.write_text(text.replace("size_m: [0.", "size_m: [0.1"))
    with pytest.raises(InputError, match="size_m is"):
        load_object_directory(box)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "holds no object"),
        (b"[" * 5_000, "nested too deeply"),
        (b"a: &x [1]\nb: *x\n", "aliases"),
        (b"!!python/object/apply:os.system [id]", "not readable YAML"),
        (b"#" * 200_001, "too large"),
        (b"\xff\xfe", "not UTF-8"),
    ],
)
def test_hostile_descriptions_are_refused(box: Path, content: bytes, message: str) -> None:
    (box / "object.yaml").write_bytes(content)
    with pytest.raises(InputError, match=message):
        load_object_directory(box)


def _members(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def _header(shape: str, descr: str = "<f8") -> bytes:
    head = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"
    head = head.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode()


@pytest.mark.parametrize(
    ("key", "content", "message"),
    [
        ("visual_0_vertices.npy", _npy(np.array([[1.0, 2.0, np.nan]])), "not finite"),
        ("visual_0_uv.npy", _npy(np.array([[1.0, 1e300]])), r"beyond 1e\+30"),
        ("visual_0_vertices.npy", _npy(np.array([{"a": 1}], dtype=object)), "allow_pickle=False"),
        ("visual_0_vertices.npy", _npy(np.zeros((3, 2))), "rows of 3"),
        ("visual_0_vertices.npy", _npy(np.zeros((0, 3))), "rows of 3"),
        ("visual_0_vertices.npy", _header("(100000000000, 3)"), r"not a readable \.npz"),
        ("visual_0_vertices.npy", _header("(50, 3)") + b"\0" * 8, r"not a readable \.npz"),
        ("visual_0_vertices.npy", _header("(((((((("), r"not a readable \.npz"),
        ("visual_0_vertices.npy", b"\x93NUMPY\x03\x00" + b"\0" * 200, r"not a readable \.npz"),
        ("visual_0_vertices.npy", b"nothing", "is no array"),
        ("visual_0_faces.npy", _npy(np.array([[0, 1, 10**6]])), "points beyond"),
        ("visual_0_faces.npy", _npy(np.array([[0, 1, -1]])), "no indices"),
        ("visual_0_uv.npy", _npy(np.zeros((5, 2))), "one row per vertex"),
        ("extra.npy", _npy(np.zeros((5, 2))), "not expected: extra"),
    ],
)
def test_hostile_arrays_are_refused(box: Path, key: str, content: bytes, message: str) -> None:
    members = _members(box / "geometry.npz") | {key: content}
    with zipfile.ZipFile(box / "geometry.npz", "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    with pytest.raises(InputError, match=message):
        load_object_directory(box)


def test_an_array_that_unpacks_to_gigabytes_is_refused(box: Path) -> None:
    members = _members(box / "geometry.npz")
    with zipfile.ZipFile(box / "geometry.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, b"\0" * 51_000_000 if name == "visual_0_vertices.npy" else data)
    assert (box / "geometry.npz").stat().st_size < 200_000
    with pytest.raises(InputError, match=r"unpacks to 51\d+ bytes in all; at most"):
        load_object_directory(box)


def test_arrays_that_are_too_large_together_are_refused(box: Path) -> None:
    text = (box / "object.yaml").read_text()
    text += "".join(text[text.index("- rgba") :] for _ in range(3)).replace("texture_0.png", "null")
    (box / "object.yaml").write_text(text)
    members = _members(box / "geometry.npz")
    full = {"vertices": _npy(np.zeros((600_000, 3))), "uv": _npy(np.zeros((600_000, 2)))}
    with zipfile.ZipFile(box / "geometry.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for i in range(4):
            for key in ("vertices", "faces", "uv", "normals"):
                archive.writestr(f"visual_{i}_{key}.npy", full.get(key, members[f"visual_0_{key}.npy"]))
    with pytest.raises(InputError, match="bytes in all; at most"):
        load_object_directory(box)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 and no more", b"\0" * 1000])
def test_what_is_no_archive_is_refused(box: Path, content: bytes) -> None:
    (box / "geometry.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"not a readable \.npz"):
        load_object_directory(box)


def _png_of(width: int, height: int) -> bytes:
    """A picture of one colour whose header tells its size; a few kilobytes."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        crc = zlib.crc32(kind + body).to_bytes(4, "big")
        return len(body).to_bytes(4, "big") + kind + body + crc

    head = width.to_bytes(4, "big") + height.to_bytes(4, "big") + b"\x08\x02\0\0\0"
    data = zlib.compress(b"\0" * 1000)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (_png_of(60_000, 60_000), "texture_0.png"),
        (_png_of(12_000, 12_000), "texture_0.png"),
        (_png_of(4_000, 10), "at most 2048"),
        (_png_of(64, 64), "no readable picture"),
        (b"GIF89a" + b"\0" * 50, "no readable picture"),
        (b"", "no readable picture"),
    ],
)
def test_hostile_textures_are_refused(box: Path, content: bytes, message: str) -> None:
    (box / "texture_0.png").write_bytes(content)
    with pytest.raises(InputError, match=message):
        load_object_directory(box)


@pytest.mark.parametrize("file", ["object.yaml", "geometry.npz", "texture_0.png"])
def test_links_and_pipes_are_not_followed(box: Path, file: str, tmp_path: Path) -> None:
    (box / file).rename(tmp_path / "elsewhere")
    (box / file).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="is a link"):
        load_object_directory(box)
    (box / file).unlink()
    os.mkfifo(box / file)
    with pytest.raises(InputError, match="not a plain file"):
        load_object_directory(box)
    (box / file).unlink()
    with pytest.raises(InputError, match="is missing"):
        load_object_directory(box)


def test_trusted_objects_may_be_linked(box: Path, tmp_path: Path) -> None:
    linked = tmp_path / "linked" / box.name
    linked.mkdir(parents=True)
    for file in box.iterdir():
        (linked / file.name).symlink_to(file)
    assert_same(load_object(box.name), load_object_directory(linked, trusted=True))


def test_flat_pieces_are_refused(bowl: Path) -> None:
    members = _members(bowl / "geometry.npz")
    first = next(name for name in members if name.startswith("piece_"))
    flat = np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0.01, 0.01, 0]])
    with zipfile.ZipFile(bowl / "geometry.npz", "w") as archive:
        for name, data in members.items():
            archive.writestr(name, _npy(flat) if name == first else data)
    with pytest.raises(InputError, match="flat or degenerate"):
        load_object_directory(bowl)


def test_surfaces_far_beyond_the_pieces_are_refused(box: Path) -> None:
    members = _members(box / "geometry.npz")
    vertices = np.load(io.BytesIO(members["visual_0_vertices.npy"])) * 50
    with zipfile.ZipFile(box / "geometry.npz", "w") as archive:
        for name, data in members.items():
            archive.writestr(name, _npy(vertices) if name == "visual_0_vertices.npy" else data)
    with pytest.raises(InputError, match="far beyond"):
        load_object_directory(box)


def test_an_object_outside_the_limits_is_not_saved(tmp_path: Path) -> None:
    from dataclasses import replace

    with pytest.raises(InputError, match="mass_kg"):
        save_object(replace(load_object("mug_red"), mass_kg=500.0), tmp_path / "mug_red")
    assert not (tmp_path / "mug_red").exists()
    assert [p.name for p in tmp_path.iterdir() if p.name != "objects"] == []


def test_truncation_anywhere_is_noticed(box: Path, tmp_path: Path) -> None:
    for file in ("geometry.npz", "texture_0.png"):
        data = (box / file).read_bytes()
        for share in (0.1, 0.5, 0.9, 0.99):
            broken = tmp_path / f"broken{share}" / file / box.name
            shutil.copytree(box, broken)
            (broken / file).write_bytes(data[: int(share * len(data))])
            with pytest.raises(InputError, match=file):
                load_object_directory(broken)


def test_pictures_keep_their_colours(tmp_path: Path) -> None:
    model = load_object("mug_red")
    save_object(model, tmp_path / "mug_red")
    texture = next(v.texture for v in model.visuals if v.texture is not None)
    stored = [np.array(Image.open(p)) for p in sorted((tmp_path / "mug_red").glob("*.png"))]
    assert any(np.array_equal(texture, s) for s in stored)
