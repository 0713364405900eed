"""OBJ files as exporters write them give the solid that they describe."""

import contextlib
from pathlib import Path

import numpy as np
import pytest
from mesh_files import L_OUTLINE, area, enclosed_volume, png, prism, two_tone

from torc.errors import InputError
from torc.scenes.importing.reading import read_surfaces
from torc.scenes.importing.reading.obj.tables import read_obj_tables
from torc.scenes.importing.surfaces import GREY, Surface

VERTICES, POLYGONS = prism(L_OUTLINE, 0.05)
V_LINES = "".join(f"v {x} {y} {z}\n" for x, y, z in VERTICES)
F_LINES = "".join("f " + " ".join(str(i + 1) for i in p) + "\n" for p in POLYGONS)


def _read(path: Path, text: str) -> list[Surface]:
    path.write_text(text)
    return read_surfaces(path, 1.0, False, path.parent, 64)[0]


def _is_the_prism(surface: Surface) -> bool:
    perimeter = 0.4
    return bool(
        np.isclose(enclosed_volume(surface.vertices, surface.faces), 0.0051 * 0.05)
        and np.isclose(area(surface.vertices, surface.faces), 2 * 0.0051 + perimeter * 0.05)
    )


@pytest.mark.parametrize(
    "text",
    [
        V_LINES + F_LINES,
        (V_LINES + F_LINES).replace(" ", "\t"),
        (V_LINES + F_LINES).replace("\n", "\r\n"),
        (V_LINES + F_LINES).replace(" ", "   "),
        V_LINES + F_LINES.replace("\n", "  # a face\n"),
        V_LINES + F_LINES.replace(" 2", " \\\n 2"),
        V_LINES + "".join("f " + " ".join(str(i - 12) for i in p) + "\n" for p in POLYGONS),
        V_LINES + "vn 0 0 1\n" + "".join("f " + " ".join(f"{i + 1}//-1" for i in p) + "\n" for p in POLYGONS),
        "\n".join("  " + line for line in (V_LINES + F_LINES).splitlines()),
    ],
    ids=["plain", "tabs", "crlf", "spaces", "comments", "continued", "relative", "normals", "indented"],
)
def test_a_concave_prism_is_the_same_solid_however_it_is_written(tmp_path: Path, text: str) -> None:
    (surface,) = _read(tmp_path / "l.obj", text)
    assert _is_the_prism(surface)


def test_relative_indices_count_back_from_where_they_stand(tmp_path: Path) -> None:
    one = V_LINES + "".join("f " + " ".join(str(i - 12) for i in p) + "\n" for p in POLYGONS)
    other = one.replace("v 0.0", "v 1.0").replace("v 0.1", "v 1.1").replace("v 0.03", "v 1.03")
    surfaces = _read(tmp_path / "two.obj", one + other)
    volume = sum(enclosed_volume(s.vertices, s.faces) for s in surfaces)
    assert volume == pytest.approx(2 * 0.0051 * 0.05)


def test_texture_coordinates_follow_the_corners_of_a_polygon(tmp_path: Path) -> None:
    two_tone().save(tmp_path / "paper.png")
    (tmp_path / "m.mtl").write_text("newmtl paper\nmap_Kd paper.png\n")
    coordinates = "".join(f"vt {x * 10} {y * 10}\n" for x, y in L_OUTLINE)
    cap = "f " + " ".join(f"{7 + i}/{1 + i}" for i in range(6)) + "\n"
    (surface,) = _read(tmp_path / "l.obj", "mtllib m.mtl\n" + V_LINES + coordinates + "usemtl paper\n" + cap)
    assert surface.uv is not None
    np.testing.assert_allclose(surface.uv[:, 0], 10 * surface.vertices[:, 0], atol=1e-6)
    np.testing.assert_allclose(surface.uv[:, 1], 1 - 10 * surface.vertices[:, 1], atol=1e-6)
    assert area(surface.vertices, surface.faces) == pytest.approx(0.0051)


@pytest.mark.parametrize("head", ["mtllib a.mtl b.mtl\n", "mtllib a.mtl\nmtllib b.mtl\n"])
def test_all_material_libraries_are_read(tmp_path: Path, head: str) -> None:
    (tmp_path / "a.mtl").write_text("newmtl a\nKd 1 0 0\n")
    (tmp_path / "b.mtl").write_text("newmtl b\nKd 0 0 1\n")
    faces = F_LINES.splitlines()
    text = "\n".join(["usemtl a", *faces[:4], "usemtl b", *faces[4:]])
    surfaces = _read(tmp_path / "l.obj", head + V_LINES + text)
    assert sorted(s.rgba for s in surfaces) == [(0.0, 0.0, 1.0, 1.0), (1.0, 0.0, 0.0, 1.0)]


@pytest.mark.parametrize(
    ("line", "names"),
    [
        (b"mtllib my red things.mtl", ("my red things.mtl",)),
        (b"mtllib ./my.mtl  other.MTL ", ("./my.mtl", "other.MTL")),
        (b"mtllib paint", ("paint",)),
        (b"# mtllib a.mtl", ()),
        (b"mtllib a.mtl\nmtllib a.mtl\nmtllib b.mtl", ("a.mtl", "b.mtl")),
    ],
)
def test_libraries_are_found_by_their_names(line: bytes, names: tuple[str, ...]) -> None:
    assert read_obj_tables(line + b"\n").libraries == names


@pytest.mark.parametrize("face", ["f 1 2 3 99", "f -1 -2 -3 -99", "f 0 1 2 3", "f 1 2 3 x", "f 1 2 3 4/-"])
def test_faces_without_corners_are_refused(tmp_path: Path, face: str) -> None:
    with pytest.raises(InputError, match="not a readable OBJ file"):
        _read(tmp_path / "l.obj", V_LINES + face + "\n")


TRIANGLES = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n"
COORDINATES = "vt 0 0\nvt 1 0\nvt 0 1\n"


def _with_material(directory: Path, mtl: str | bytes, faces: str, head: str = "usemtl a\n") -> list[Surface]:
    two_tone(16).save(directory / "t.png")
    (directory / "m.mtl").write_bytes(mtl if isinstance(mtl, bytes) else mtl.encode())
    return _read(directory / "a.obj", "mtllib m.mtl\n" + TRIANGLES + COORDINATES + head + faces)


@pytest.mark.parametrize(
    "faces",
    [
        "f 1/1 3/2 2/3\nf 1 4 3\n",
        "f 1/1 3/2 2/3\nf 1//1 2//1 4//1\n",
        "f 1//1 2//1 4//1\nf 1/1/1 3/2/1 2/3/1\n",
    ],
)
def test_faces_of_several_forms_keep_their_coordinates(faces: str, tmp_path: Path) -> None:
    surfaces = _with_material(tmp_path, "newmtl a\nKd 0 1 0\nmap_Kd t.png\n", faces)
    plain, painted = sorted(surfaces, key=lambda s: s.texture is not None)
    assert plain.rgba == (0.0, 1.0, 0.0, 1.0)
    assert painted.uv is not None
    at = {
        tuple((10 * v).round().astype(int).tolist()): tuple(uv) for v, uv in zip(painted.vertices, painted.uv)
    }
    assert at == {(0, 0, 0): (0.0, 1.0), (0, 1, 0): (1.0, 1.0), (1, 0, 0): (0.0, 0.0)}


@pytest.mark.parametrize("face", ["f 1/1 3/2 2/9\n", "f 1/1 3/2 2/-9\n", "f 1/ 3/ 2/\n"])
def test_coordinates_that_are_not_there_are_told(face: str, tmp_path: Path) -> None:
    (surface,) = _with_material(tmp_path, "newmtl a\nKd 0 1 0\nmap_Kd t.png\n", face)
    assert surface.texture is None
    _, notes = read_surfaces(tmp_path / "a.obj", 1.0, False, tmp_path, 64)
    assert notes == ["Faces without texture coordinates are shown without their texture."]


@pytest.mark.parametrize(
    ("mtl", "head"),
    [
        ("newmtl My  Red\nKd 1 0 0\n", "usemtl My   Red\n"),
        ("\ufeffnewmtl a\nKd 1 0 0\n", "usemtl a\n"),
        ("newmtl a\nKd 1 0 0\n".encode("utf-16"), "usemtl a\n"),
        ("newmtl a\nKd 1 0 0 # red\n", "usemtl a # it is red\n"),
        ("\tnewmtl a\r\n\tKd 1 0 0\r\n", "usemtl a\n"),
        ("newmtl a\nself 3\nname x\ndiffuse y\nkd 1 0 0\nimage t.png\n", "usemtl a\n"),
        ("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\nnewmtl a\nKd 0 0 1\n", "usemtl a\n"),
    ],
)
def test_materials_are_found_however_they_are_written(mtl: str | bytes, head: str, tmp_path: Path) -> None:
    (surface,) = _with_material(tmp_path, mtl, "f 1 2 3\n", head)
    assert surface.rgba == (1.0, 0.0, 0.0, 1.0)


def test_names_in_an_old_encoding_are_the_same_in_both_files(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_bytes("newmtl grün\nKd 0 1 0\n".encode("latin-1"))
    (tmp_path / "a.obj").write_bytes(f"mtllib m.mtl\n{TRIANGLES}usemtl grün\nf 1 2 3\n".encode("latin-1"))
    (surface,), notes = read_surfaces(tmp_path / "a.obj", 1.0, False, tmp_path, 64)
    assert surface.rgba == (0.0, 1.0, 0.0, 1.0)
    assert notes == []


@pytest.mark.parametrize(
    ("line", "rgba"),
    [
        ("Kd 0.1", (0.1, 0.1, 0.1, 1.0)),
        ("Kd 2 -1 0.5", (1.0, 0.0, 0.5, 1.0)),
        ("Kd spectral x.rfl", GREY),
        ("Kd nan 0 0", GREY),
        ("", GREY),
    ],
)
def test_colours_of_materials(line: str, rgba: tuple[float, ...], tmp_path: Path) -> None:
    (surface,) = _with_material(tmp_path, f"newmtl a\n{line}\n", "f 1 2 3\n")
    assert surface.rgba == pytest.approx(rgba)


def test_a_material_that_is_not_there_is_told(tmp_path: Path) -> None:
    _with_material(tmp_path, "newmtl a\nKd 1 0 0\n", "f 1 2 3\nusemtl zz\nf 1 2 4\n")
    _, notes = read_surfaces(tmp_path / "a.obj", 1.0, False, tmp_path, 64)
    assert notes == ["1 materials are not in its library: their colours are missing (zz)."]
    (surface,) = _read(tmp_path / "b.obj", TRIANGLES + COORDINATES + "f 1/1 2/2 3/3\n")
    assert surface.rgba == GREY


@pytest.mark.parametrize(
    ("line", "uv"),
    [
        ("map_Kd -s 1 1 1 t.png", (1.0, 0.0)),
        ("map_Kd -clamp on -bm 1 -s 2 3 t.png", (2.0, 0.0)),
        ("map_kd -o 0.5 0.25 0 -mm 0 1 t.png # a picture", (1.5, 0.25)),
        ('map_Kd "t.png"', (1.0, 0.0)),
    ],
)
def test_options_of_textures_are_understood(line: str, uv: tuple[float, float], tmp_path: Path) -> None:
    (surface,) = _with_material(tmp_path, f"newmtl a\n{line}\n", "f 1/1 2/2 3/3\n")
    assert surface.uv is not None
    np.testing.assert_allclose(surface.uv[1], (uv[0], 1 - uv[1]))


@pytest.mark.parametrize("most", [1, 255])
def test_corners_may_have_colours_and_some_may_not(most: int, tmp_path: Path) -> None:
    rows = TRIANGLES.splitlines()
    coloured = "\n".join([f"{row} {most} 0 0" for row in rows[:3]] + rows[3:]) + "\n"
    for text in (coloured, coloured + COORDINATES, "mtllib m.mtl\n" + coloured + "usemtl a\n"):
        (tmp_path / "m.mtl").write_text("newmtl a\nKd 0.8 0.8 0.8\n")
        face = "f 1 2 3\nf 1 2 4\n" if "vt" not in text else "f 1/1 2/2 3/3\nf 1/1 2/2 4/3\n"
        (surface,) = _read(tmp_path / "a.obj", text + face)
        assert surface.colours is not None
        assert surface.colours[:3].tolist() == [[255, 0, 0]] * 3
        assert surface.colours[3].min() > 150


@pytest.mark.parametrize(
    "text",
    [
        TRIANGLES + "f 1 2 3 99999999999999999999999\n",
        TRIANGLES + "f 1/1/1/1 2 3\n",
        TRIANGLES + "f 1.5 2 3\n",
        TRIANGLES + "f 0 1 2\n",
        TRIANGLES.replace("0.1", "x") + "f 1 2 3\n",
        "v 1 2 3\n" + "".join(f"usemtl {i}\nf 1 1 1\n" for i in range(2001)),
    ],
)
def test_what_is_no_obj_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a readable OBJ file"):
        _read(tmp_path / "a.obj", text)


@pytest.mark.parametrize(
    "text", ["mtllib x" + 2_000_000 * " " + "y\n", "mtllib " + 2_000_000 * "a" + "\n", 500_000 * "f\n"]
)
def test_long_lines_and_many_take_no_time(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(TRIANGLES + text + "f 1 2 3\n")
    with contextlib.suppress(InputError):  # quadratic work on them takes longer than a test may
        read_surfaces(tmp_path / "a.obj", 1.0, False, tmp_path, 64)


def test_names_may_have_a_hash_in_them(tmp_path: Path) -> None:
    (tmp_path / "wood #2.png").write_bytes(png(two_tone(16)))
    mtl = "newmtl Color #1\nKd 1 0 0\nnewmtl Color #2\nmap_Kd wood #2.png\n"
    faces = "f 1/1 2/2 3/3\nusemtl Color #2\nf 1/1 2/2 4/3\n"
    red, wooden = _with_material(tmp_path, mtl, faces, "usemtl Color #1\n")
    assert red.rgba == (1.0, 0.0, 0.0, 1.0)
    assert wooden.texture is not None


def test_a_texture_of_many_materials_is_read_once(tmp_path: Path) -> None:
    mtl = "".join(f"newmtl m{i}\nmap_Kd t.png\n" for i in range(30))
    faces = "".join(f"usemtl m{i}\nf 1/1 2/2 {3 + i % 2}/3\n" for i in range(30))
    surfaces = _with_material(tmp_path, mtl, faces)
    assert len({id(s.texture) for s in surfaces}) == 1


def test_what_a_texture_shows_is_not_shown_twice(tmp_path: Path) -> None:
    grey = "".join(f"{row} 0.5 0.5 0.5\n" for row in TRIANGLES.splitlines())
    two_tone(16).save(tmp_path / "t.png")
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd t.png\n")
    text = "mtllib m.mtl\n" + grey + COORDINATES + "usemtl a\nf 1/1 2/2 3/3\n"
    (surface,) = _read(tmp_path / "a.obj", text)
    assert surface.texture is not None
    assert surface.colours is None
    assert surface.rgba == (1.0, 1.0, 1.0, 1.0)


def test_a_white_layer_of_colours_is_none(tmp_path: Path) -> None:
    white = "".join(f"{row} 1 1 1\n" for row in TRIANGLES.splitlines())
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 0.8 0.1 0.1\n")
    (surface,) = _read(tmp_path / "a.obj", "mtllib m.mtl\n" + white + "usemtl a\nf 1 2 3\n")
    assert surface.rgba == (0.8, 0.1, 0.1, 1.0)


def test_fractions_may_be_a_little_above_one(tmp_path: Path) -> None:
    text = "v 0 0 0 1.004 0.5 0\nv 0.1 0 0 0.5 0.5 0.5\nv 0 0.1 0 0 1 0\nf 1 2 3\n"
    (surface,) = _read(tmp_path / "a.obj", text)
    assert surface.colours is not None
    assert surface.colours.tolist() == [[255, 128, 0], [128, 128, 128], [0, 255, 0]]


@pytest.mark.parametrize(
    "text",
    [
        "# made in D:\\out\\\n" + TRIANGLES + "f 1 2 3\n",
        TRIANGLES + "vt -nan(ind) -1.#IND\nf 1/1 2/1 3/1\n",
        "mtllib m.mtl # the colours\n" + TRIANGLES + "usemtl a\nf 1 2 3\n",
    ],
)
def test_oddities_of_programs_do_no_harm(text: str, tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text('newmtl a\nmap_Kd ""\n')
    (tmp_path / "a.obj").write_text(text)
    (surface,), notes = read_surfaces(tmp_path / "a.obj", 1.0, False, tmp_path, 64)
    np.testing.assert_allclose(surface.vertices[surface.faces[0]], [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0)])
    assert notes == []
