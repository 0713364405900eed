"""OBJ files as exporters write them give the solid that they describe."""

from pathlib import Path

import numpy as np
import pytest
from mesh_files import L_OUTLINE, area, enclosed_volume, prism, two_tone

from torc.errors import InputError
from torc.scenes.importing.reading import read_surfaces
from torc.scenes.importing.reading.obj_text import plain_obj
from torc.scenes.importing.surfaces import Surface

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


def test_a_library_may_have_spaces_in_its_name() -> None:
    assert plain_obj(b"mtllib my red things.mtl\n").libraries == ("my red things.mtl",)
    assert plain_obj(b"mtllib ./my.mtl other.mtl \n").libraries == ("./my.mtl", "other.mtl")
    assert plain_obj(V_LINES.encode()).libraries == ()


def test_names_keep_their_signs() -> None:
    text = b"o red#1\nusemtl paint#2\nv 0 0 0 # first\n"
    assert plain_obj(text).text == b"o red#1\nusemtl paint#2\nv 0 0 0 \n"


@pytest.mark.parametrize("face", ["f 1 2 3 99", "f -1 -2 -3 -99", "f 0 1 2 3", "f 1 2 3 x", "f 1 2 3 4/-"])
def test_faces_without_corners_are_refused(tmp_path: Path, face: str) -> None:
    with pytest.raises(InputError, match="not a readable OBJ file"):
        _read(tmp_path / "l.obj", V_LINES + face + "\n")
