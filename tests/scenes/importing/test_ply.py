"""PLY files, text or binary, with polygons, colours and textures."""

import struct
import time
import tracemalloc
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


def _noted(path: Path, content: bytes) -> tuple[list[Surface], list[str]]:
    path.write_bytes(content)
    return read_surfaces(path, 1.0, False, path.parent, 64)


def _read(path: Path, content: bytes) -> list[Surface]:
    return _noted(path, content)[0]


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
        ("\n6 5 4", "\n6 5 3.7", "number of a corner is 3.7"),
        ("\n6 5 4", "\n6 5 nan", "number of a corner is nan"),
        ("\n6 5 4", "\n6 5 1e300", r"number of a corner is 1e\+300"),
        ("end_header", "element vertex 0\nproperty float x\nend_header", "2 tables of the name vertex"),
        ("\nend_header", "\n end_header", "no end"),
        ("end_header\n", "end_header", "no end"),
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


SIDES = POLYGONS[2:]
PAPERS = "comment TextureFile a.png\ncomment TextureFile: b.png"
ST = ("property float s", "property float t")
UV = VERTICES[:, :2] * 10


def _papers(directory: Path) -> None:
    two_tone(16).save(directory / "a.png")
    two_tone(32).save(directory / "b.png")


def _sizes(surfaces: list[Surface]) -> list[tuple[int, int]]:
    """Triangles of each surface, and the side of its texture."""
    return [(len(s.faces), 0 if s.texture is None else len(s.texture)) for s in surfaces]


@pytest.mark.parametrize("form", FORMS)
def test_faces_name_their_textures_where_vertices_have_the_coordinates(form: str, tmp_path: Path) -> None:
    _papers(tmp_path)
    faces = [("Biiii" + "i", [4, *p, k]) for p, k in zip(SIDES, (0, 0, 1, -1, 1, 1))]
    content = _ply(form, faces, ("property int texnumber",), PAPERS, UV, ST)
    surfaces, notes = _noted(tmp_path / "l.ply", content)
    assert _sizes(surfaces) == [(2, 0), (4, 16), (6, 32)]
    assert notes == []  # -1 means none


@pytest.mark.parametrize(
    ("numbers", "sizes", "told"),
    [
        ((0, 0, 1, 2, 9, -2), [(6, 0), (4, 16), (2, 32)], "they name others than the 2 of the file"),
        ((-1,) * 6, [(12, 0)], "none of its faces names one"),
        (None, [(12, 16)], "does not say where: the first is used"),
    ],
)
def test_textures_that_are_not_there_are_told(
    numbers: tuple[int, ...] | None, sizes: list[tuple[int, int]], told: str, tmp_path: Path
) -> None:
    _papers(tmp_path)
    faces = [("Biiii", [4, *p]) for p in SIDES]
    if numbers is not None:
        faces = [(codes + "i", [*row, k]) for (codes, row), k in zip(faces, numbers)]
    columns = () if numbers is None else ("property int texnumber",)
    surfaces, notes = _noted(tmp_path / "l.ply", _ply("binary_little_endian", faces, columns, PAPERS, UV, ST))
    assert _sizes(surfaces) == sizes
    assert [told in note for note in notes] == [True]


@pytest.mark.parametrize("number", [0.5, float("nan"), 1e300])
def test_numbers_of_textures_are_whole(number: float, tmp_path: Path) -> None:
    _papers(tmp_path)
    faces = [("Biiiid", [4, *p, number]) for p in SIDES]
    content = _ply("binary_big_endian", faces, ("property double texnumber",), PAPERS, UV, ST)
    with pytest.raises(InputError, match="number of a texture is"):
        _read(tmp_path / "l.ply", content)


def test_textures_without_coordinates_are_told(tmp_path: Path) -> None:
    _papers(tmp_path)
    surfaces, notes = _noted(tmp_path / "l.ply", _ply("ascii", _polygons(), (), PAPERS))
    assert surfaces[0].texture is None
    assert notes == ["Its textures are left out: it has no texture coordinates."]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("left", [0, 3, 6, 10, "nan"])
def test_faces_without_their_coordinates_have_no_texture_alone(
    form: str, left: int | str, tmp_path: Path
) -> None:
    _papers(tmp_path)
    faces = []
    for k, p in enumerate(SIDES):
        uv = UV[p].reshape(-1).tolist()
        if k == 1:
            uv = [float("nan")] * 8 if left == "nan" else [*uv, 0.0, 0.0][: int(left)]
        faces.append(("BiiiiB" + "f" * len(uv), [4, *p, len(uv), *uv]))
    columns = ("property list uchar float texcoord",)
    (bare, dressed), notes = _noted(
        tmp_path / "l.ply", _ply(form, faces, columns, "comment TextureFile : a.png")
    )
    assert _sizes([bare, dressed]) == [(2, 0), (10, 16)]
    np.testing.assert_allclose(bare.vertices[bare.faces][..., 0], 0.1, atol=1e-6)
    assert dressed.uv is not None
    used = dressed.faces.reshape(-1)
    wanted = dressed.vertices[used, :2] * (10, -10) + (0, 1)
    np.testing.assert_allclose(dressed.uv[used], wanted, atol=1e-6)
    assert notes == ["Some of its faces have no texture: their texture coordinates are not complete."]


@pytest.mark.parametrize("kind", ["float", "double"])
def test_fractions_beyond_one_are_colours_of_8_bits(kind: str, tmp_path: Path) -> None:
    columns = tuple(f"property {kind} {c}" for c in ("red", "green", "blue"))
    tints = np.tile([200.0, 1.0, 0.0], (12, 1))
    tints[0] = np.nan, np.inf, -5.0
    (surface,) = _read(
        tmp_path / "l.ply", _ply("ascii", _polygons(), vertex_extra=tints, vertex_properties=columns)
    )
    assert surface.colours is not None
    assert surface.colours[1:].tolist() == [[200, 1, 0]] * 11
    tints = np.tile([1.0000001, 0.5, 0.0], (12, 1))
    (surface,) = _read(
        tmp_path / "l.ply", _ply("ascii", _polygons(), vertex_extra=tints, vertex_properties=columns)
    )
    assert surface.rgba == pytest.approx((1.0, 128 / 255, 0.0, 1.0))


def test_odd_bits_that_are_no_numbers_do_not_warn(tmp_path: Path) -> None:
    content = _ply("binary_little_endian", _polygons())
    at = content.index(b"end_header") + 11
    signalling = struct.pack("<I", 0x7F800001)
    (surface,) = _read(tmp_path / "l.ply", content[:at] + signalling + content[at + 4 :])
    assert np.isnan(surface.vertices[0, 0])
    content = content.replace(b"list uchar int", b"list uchar float")
    at = content.index(b"end_header") + 11 + 12 * len(VERTICES) + 1
    with pytest.raises(InputError, match="number of a corner is nan"):
        _read(tmp_path / "l.ply", content[:at] + signalling + content[at + 4 :])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("kind", "code"), [("int64", "q"), ("uint64", "Q")])
def test_numbers_of_64_bits_are_read(form: str, kind: str, code: str, tmp_path: Path) -> None:
    faces = [(code + code * len(p), [len(p), *p]) for p in POLYGONS]
    content = _ply(form, faces).replace(b"list uchar int", f"list {kind} {kind}".encode())
    (surface,) = _read(tmp_path / "l.ply", content)
    assert enclosed_volume(surface.vertices, surface.faces) == pytest.approx(0.0051 * 0.05, rel=1e-5)
    if form != "ascii":
        largest = struct.pack(("<" if "little" in form else ">") + code, 2**63 - 1)
        start = len(content) - len(_rows(form, faces))
        with pytest.raises(InputError, match="cut off"):
            _read(tmp_path / "l.ply", content[:start] + largest + content[start + 8 :])
        with pytest.raises(InputError, match=r"number of a corner|beyond the 12"):
            _read(tmp_path / "l.ply", content[: start + 8] + largest + content[start + 16 :])


@pytest.mark.parametrize("form", FORMS)
def test_headers_may_end_their_lines_as_they_like(form: str, tmp_path: Path) -> None:
    content = _ply(form, _polygons(), vertex_extra=None)
    at = content.index(b"end_header") + 11
    for ending in (b"\r", b"\r\n", b" \r\n"):
        header = content[:at].replace(b"\n", ending)
        (surface,) = _read(tmp_path / "l.ply", header + content[at:])
        assert enclosed_volume(surface.vertices, surface.faces) == pytest.approx(0.0051 * 0.05, rel=1e-5)


def test_numbers_that_look_like_a_line_end_belong_to_the_content(tmp_path: Path) -> None:
    """After a header of the old kind of line ends, the first byte of the content is a line feed."""
    vertices, faces = box((1.0, 1.0, 1.0))
    head = "ply\rformat binary_little_endian 1.0\relement note 1\rproperty uchar n\relement vertex 8\r"
    head += "property float x\rproperty float y\rproperty float z\relement face 12\r"
    head += "property list uchar int vertex_index\rend_header\r"
    body = b"\n" + vertices.astype("<f4").tobytes()
    body += b"".join(struct.pack("<B3i", 3, *face) for face in faces.tolist())
    (surface,) = _read(tmp_path / "box.ply", head.encode() + body)
    assert enclosed_volume(surface.vertices, surface.faces) == pytest.approx(1.0)


def test_headers_without_end_are_refused_at_once(tmp_path: Path) -> None:
    started = time.process_time()
    for filling in (b"\n" * 49_000, b"\nend_header x" * 4_000, b"\r" * 49_000):
        with pytest.raises(InputError, match="no end"):
            _read(tmp_path / "l.ply", b"ply\n" + filling + b" x end_header")
    assert time.process_time() - started < 1.0


def _peak(path: Path) -> int:
    """Bytes that reading a damaged file needs at most."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError):
            read_surfaces(path, 1.0, False, path.parent, 64)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("kind", ["uchar", "double"])
@pytest.mark.parametrize("lists", [1, 200])
@pytest.mark.parametrize("rows", ["announced", "there", "of several lengths"])
def test_memory_is_bounded_by_the_file(kind: str, lists: int, rows: str, tmp_path: Path) -> None:
    count = 100_000 if rows == "announced" else 100_000 // lists
    names = "\n".join(f"property list uchar {kind} a{i}" for i in range(lists))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{names}\nend_header\n"
    body = bytearray(100_000)
    if rows == "of several lengths":
        body[-1] = 1
        body += bytes(8 if kind == "double" else 1)
    path = tmp_path / "l.ply"
    path.write_bytes(head.encode() + body)
    assert _peak(path) < 40 * path.stat().st_size


@pytest.mark.parametrize("form", FORMS)
def test_triangle_strips_are_unrolled(form: str, tmp_path: Path) -> None:
    """A prism; -1 parts its sides, and corners that are there twice join the last of them to the top."""
    strips = [[0, 1, 2, 3, -1, 2, 3, 4, 5], [], [-1, -1, 4, 5, 0, 1, 1, 0, 0, 2, 4, -1], [2, 0], [1, 5, 3]]
    points = [(x, y, z) for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)) for z in (1.0, 0.0)]
    rows = [("fff", list(p)) for p in points]
    lists = [("i" * (1 + len(s)), [len(s), *s]) for s in strips]
    head = f"ply\nformat {form} 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 0\nproperty list uchar int vertex_indices\nproperty uchar red\n"
    head += f"element tristrips {len(strips)}\n"
    head += "property list int int vertex_indices\nend_header\n"
    (surface,) = _read(tmp_path / "tube.ply", head.encode() + _rows(form, rows) + _rows(form, lists))
    assert len(surface.faces) == 8
    assert enclosed_volume(surface.vertices, surface.faces) == pytest.approx(0.5)
    assert area(surface.vertices, surface.faces) == pytest.approx(3 + 2**0.5)


def test_strips_beside_faces_are_refused(tmp_path: Path) -> None:
    strip = b"element tristrips 1\nproperty list uchar int vertex_indices\nend_header"
    content = _ply("ascii", _polygons()).replace(b"end_header", strip) + b"3 0 1 2\n"
    with pytest.raises(InputError, match="both faces and triangle strips; write all of it as faces"):
        _read(tmp_path / "l.ply", content)


@pytest.mark.parametrize("name", ["face", "tristrips"])
@pytest.mark.parametrize("column", ["corners", "texcoord"])
def test_faces_and_strips_without_corners_are_refused(name: str, column: str, tmp_path: Path) -> None:
    content = _ply("ascii", _polygons(), (), PAPERS, UV, ST)
    content = content.replace(b"element face", b"element " + name.encode())
    with pytest.raises(InputError, match="no list of vertex_indices; export it again, with triangles"):
        _read(tmp_path / "l.ply", content.replace(b"vertex_indices", column.encode()))
    empty = _ply("ascii", [], (), "element tristrips 0").replace(b"vertex_indices", column.encode())
    with pytest.raises(InputError, match="holds no triangles"):
        _read(tmp_path / "l.ply", empty)
