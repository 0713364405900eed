"""PLY files, text or binary, with polygons, colours and textures."""

import struct
from pathlib import Path

import numpy as np
import pytest
from mesh_files import L_OUTLINE, area, box, enclosed_volume, prism, two_tone

from torc.errors import InputError
from torc.scenes.importing.reading import read_surfaces
from torc.scenes.importing.surfaces import Surface

VERTICES, POLYGONS = prism(L_OUTLINE, 0.05)
FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]


def _rows(form: str, rows: list[tuple[str, list[float]]]) -> bytes:
    """Rows of numbers, each with its codes for struct."""
    if form == "ascii":
        return "".join(" ".join(f"{v:.9g}" for v in values) + "\n" for _, values in rows).encode()
    sign = "<" if "little" in form else ">"
    return b"".join(struct.pack(sign + codes, *values) for codes, values in rows)


def _ply(
    form: str,
    faces: list[tuple[str, list[float]]],
    face_properties: tuple[str, ...] = (),
    head: str = "",
    vertex_extra: np.ndarray | None = None,
    vertex_properties: tuple[str, ...] = (),
) -> bytes:
    """A prism's file; `faces`: rows that begin with the list of corners."""
    lines = ["ply", f"format {form} 1.0", *head.splitlines(), f"element vertex {len(VERTICES)}"]
    lines += ["property float x", "property float y", "property float z", *vertex_properties]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", *face_properties]
    extra = np.zeros((len(VERTICES), 0)) if vertex_extra is None else vertex_extra
    rows = [("fff" + "f" * len(e), [*v, *e]) for v, e in zip(VERTICES.tolist(), extra.tolist())]
    return "\n".join([*lines, "end_header", ""]).encode() + _rows(form, rows) + _rows(form, faces)


def _polygons() -> list[tuple[str, list[float]]]:
    return [("B" + "i" * len(p), [len(p), *p]) for p in POLYGONS]


def _read(path: Path, content: bytes) -> list[Surface]:
    path.write_bytes(content)
    return read_surfaces(path, 1.0, False, path.parent, 64)[0]


@pytest.mark.parametrize("form", FORMS)
def test_polygons_of_several_lengths_give_the_solid(form: str, tmp_path: Path) -> None:
    (surface,) = _read(tmp_path / "l.ply", _ply(form, _polygons()))
    assert enclosed_volume(surface.vertices, surface.faces) == pytest.approx(0.0051 * 0.05, rel=1e-5)
    assert area(surface.vertices, surface.faces) == pytest.approx(2 * 0.0051 + 0.4 * 0.05, rel=1e-5)


@pytest.mark.parametrize("form", FORMS)
def test_faces_of_one_length_and_with_colours(form: str, tmp_path: Path) -> None:
    sides = POLYGONS[2:]
    faces = [("B" + "iiii" + "BBB", [4, *p, 40 * i, 255, 0]) for i, p in enumerate(sides)]
    colours = tuple(f"property uchar {c}" for c in ("red", "green", "blue"))
    (surface,) = _read(tmp_path / "l.ply", _ply(form, faces, colours))
    assert surface.colours is not None
    assert len(surface.faces) == 12
    np.testing.assert_array_equal(surface.colours[surface.faces[:, 0], 0], np.repeat(40 * np.arange(6), 2))
    assert (surface.colours[:, 1:] == (255, 0)).all()
    (plain,), _ = read_surfaces(tmp_path / "l.ply", 1.0, False, None, 64)
    assert plain.colours is None


@pytest.mark.parametrize("form", FORMS)
def test_fractions_are_colours_too(form: str, tmp_path: Path) -> None:
    columns = tuple(f"property float {c}" for c in ("red", "green", "blue"))
    tints = np.tile([1.0, 0.5, 0.0], (12, 1))
    (surface,) = _read(
        tmp_path / "l.ply", _ply(form, _polygons(), vertex_extra=tints, vertex_properties=columns)
    )
    assert surface.rgba == pytest.approx((1.0, 128 / 255, 0.0, 1.0))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("wedges", [False, True], ids=["of vertices", "of faces"])
def test_textures_are_the_right_way_up(form: str, wedges: bool, tmp_path: Path) -> None:
    two_tone().save(tmp_path / "paper.png")
    uv = VERTICES[:, :2] * 10  # v up
    if wedges:
        faces = []
        for p in POLYGONS[:2]:
            flat = uv[p].reshape(-1).tolist()
            faces.append(("B" + "i" * 6 + "B" + "f" * 12, [6, *p, 12, *flat]))
        content = _ply(form, faces, ("property list uchar float texcoord",), "comment TextureFile paper.png")
    else:
        columns = ("property float s", "property float t")
        content = _ply(
            form,
            _polygons()[:2],
            (),
            "comment TextureFile paper.png",
            uv,
            columns,
        )
    (surface,) = _read(tmp_path / "l.ply", content)
    assert surface.uv is not None
    assert surface.texture is not None
    used = surface.faces.reshape(-1)
    np.testing.assert_allclose(surface.uv[used, 0], 10 * surface.vertices[used, 0], atol=1e-6)
    np.testing.assert_allclose(surface.uv[used, 1], 1 - 10 * surface.vertices[used, 1], atol=1e-6)
    assert surface.rgba == (1.0, 1.0, 1.0, 1.0)


def test_every_texture_of_a_file_has_its_faces(tmp_path: Path) -> None:
    two_tone(16).save(tmp_path / "a.png")
    two_tone(32).save(tmp_path / "b.png")
    faces = [
        ("B" + "i" * 6 + "B" + "f" * 12 + "i", [6, *p, 12, *(VERTICES[p, :2] * 10).reshape(-1).tolist(), k])
        for k, p in enumerate(POLYGONS[:2])
    ]
    head = "comment TextureFile a.png\ncomment TextureFile b.png"
    columns = ("property list uchar float texcoord", "property int texnumber")
    low, high = _read(tmp_path / "l.ply", _ply("binary_little_endian", faces, columns, head))
    assert low.texture is not None
    assert high.texture is not None
    assert [low.texture.shape[0], high.texture.shape[0]] == [16, 32]
    assert low.vertices[low.faces][..., 2].max() == 0.0
    np.testing.assert_allclose(high.vertices[high.faces][..., 2], 0.05, atol=1e-6)


def test_a_missing_or_foreign_texture_is_told(tmp_path: Path) -> None:
    columns = ("property float s", "property float t")
    for name, told in (("gone.png", None), ("../../etc/passwd", "which is not below")):
        content = _ply("ascii", _polygons(), (), f"comment TextureFile {name}", VERTICES[:, :2] * 10, columns)
        (tmp_path / "l.ply").write_bytes(content)
        if told is None:
            surfaces, notes = read_surfaces(tmp_path / "l.ply", 1.0, False, tmp_path, 64)
            assert surfaces[0].texture is None
            assert notes == ["'gone.png' is not there: its colours are missing."]
        else:
            with pytest.raises(InputError, match=told):
                _read(tmp_path / "l.ply", content)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("mixed", [False, True])
def test_what_is_cut_off_is_refused_wherever_it_ends(form: str, mixed: bool, tmp_path: Path) -> None:
    content = _ply(form, _polygons() if mixed else _polygons()[2:])
    start = content.index(b"end_header") + 11
    for end in (*range(start, len(content) - 3, 7), len(content) - 3):
        with pytest.raises(InputError, match="cut off"):
            _read(tmp_path / "l.ply", content[:end])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("format ascii 1.0", "format text 1.0", "not understood"),
        ("format ascii 1.0\n", "", "names no format"),
        ("element vertex 12", "element vertex 999999999999999999", "cut off"),
        ("element vertex 12", "element vertex -3", "not understood"),
        ("element vertex 12", "element vertex ²", "not understood"),
        ("element vertex 12", "element vertices 12", "no table of vertices"),
        ("property float y", "property float x", "columns of one name"),
        ("property float y", "property word y", "not understood"),
        ("\n6 5 4", "\n6 5 x", "no number"),
        ("\n6 5 4", "\n6 5 99", "beyond the 12 vertices"),
        ("\n6 5 4", "\n6 -5 4", "beyond the 12 vertices"),
        ("\n6 5 4", "\n-6 5 4", "length -6"),
        ("\n6 5 4", "\n2.5 5 4", "length 2.5"),
        ("\n6 5 4", "\nnan 5 4", "length nan"),
        ("\n6 5 4", "\n1e300 5 4", "length|cut off"),
    ],
)
def test_files_that_are_not_what_they_should_be_are_refused(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    content = _ply("ascii", _polygons())
    assert old.encode() in content
    with pytest.raises(InputError, match=message):
        _read(tmp_path / "l.ply", content.replace(old.encode(), new.encode(), 1))


def test_other_tables_are_passed_over(tmp_path: Path) -> None:
    vertices, faces = box((0.06, 0.16, 0.21))
    head = "ply\r\nformat ascii 1.0\r\nobj_info made by hand\r\ncomment\r\nelement camera 1\r\nproperty float view\r\n"
    head += "element empty 3\r\nelement vertex 8\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\n"
    head += "element edge 2\r\nproperty list uchar int ends\r\nproperty uchar sharp\r\n"
    head += (
        "element face 12\r\nproperty uchar flags\r\nproperty list uchar uint vertex_index\r\nend_header\r\n"
    )
    rows = ["0.5", *(" ".join(map(repr, v)) for v in vertices.tolist()), "2 0 1 1", "3 0 1 2 0"]
    rows += [f"7 3 {a} {b} {c}" for a, b, c in faces.tolist()]
    (surface,) = _read(tmp_path / "box.ply", (head + "\r\n".join(rows) + "\r\n").encode())
    assert enclosed_volume(surface.vertices, surface.faces) == pytest.approx(0.06 * 0.16 * 0.21)
