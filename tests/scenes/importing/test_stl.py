"""STL files of both kinds, as programs write them."""

from pathlib import Path

import numpy as np
import pytest
from mesh_files import box, enclosed_volume, write_stl

from torc.errors import InputError
from torc.scenes.importing.reading import read_surfaces

SIZE = (0.06, 0.16, 0.21)
VERTICES, FACES = box(SIZE)


def _facet(corners: np.ndarray) -> str:
    rows = "".join(f"      vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners.tolist())
    return f"  facet normal 0 0 1\n    outer loop\n{rows}    endloop\n  endfacet\n"


TEXT = "solid a box\n" + "".join(_facet(VERTICES[face]) for face in FACES) + "endsolid a box\n"


def _volume(path: Path) -> float:
    (surface,), notes = read_surfaces(path, 1.0, False, path.parent, 64)
    assert notes == []
    return enclosed_volume(surface.vertices, surface.faces)


@pytest.mark.parametrize(
    "text",
    [
        TEXT,
        TEXT.upper().replace("E-", "e-"),
        TEXT.replace("\n", "\r\n"),
        TEXT.replace("\n", "\r"),
        TEXT.replace("a box", "my_vertex_part facet endsolid"),
        TEXT.replace("a box", ""),
        TEXT.replace("    ", "\t"),
        "\n" + TEXT,
        TEXT[: len(TEXT) // 2].rsplit("  facet", 1)[0]
        + "endsolid a box\nsolid rest\n  facet"
        + TEXT[: len(TEXT) // 2].rsplit("  facet", 1)[1]
        + TEXT[len(TEXT) // 2 :],
    ],
    ids=["plain", "capitals", "crlf", "cr", "name", "no name", "tabs", "blank line", "two solids"],
)
def test_text_is_read_however_it_is_written(text: str, tmp_path: Path) -> None:
    (tmp_path / "box.stl").write_bytes(text.encode())
    assert _volume(tmp_path / "box.stl") == pytest.approx(np.prod(SIZE))


@pytest.mark.parametrize("surplus", [b"", b"\0", b"\r\n", b"\0" * 49, b"\0" * 600])
@pytest.mark.parametrize("header", [b"", b"\xff\xfe", b"\xef\xbb\xbf", b"solid binary", b"\r\n\r\n"])
def test_binary_is_read_whatever_is_before_and_behind(surplus: bytes, header: bytes, tmp_path: Path) -> None:
    path = write_stl(tmp_path / "box.stl", VERTICES, FACES)
    data = path.read_bytes()
    path.write_bytes(header + data[len(header) :] + surplus)
    assert _volume(path) == pytest.approx(np.prod(SIZE), rel=1e-5)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("endloop", "vertex 1 2 3\n    endloop"),
        ("    endloop", ""),
        ("vertex -0.03", "vertex x"),
        ("vertex -0.03", "point -0.03"),
        ("outer loop", "loop"),
    ],
)
def test_facets_that_are_no_triangles_are_refused(old: str, new: str, tmp_path: Path) -> None:
    assert old in TEXT
    (tmp_path / "box.stl").write_text(TEXT.replace(old, new, 1))
    with pytest.raises(InputError, match="not a readable STL file"):
        read_surfaces(tmp_path / "box.stl", 1.0, False, tmp_path, 64)


@pytest.mark.parametrize(
    "text", ["solid" + "\n" * 2_000_000 + "endsolid" + "\n" * 2_000_000, "solid\nendsolid" * 99]
)
def test_nothing_in_much_text_is_told_at_once(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_text(text)
    with pytest.raises(InputError, match=r"holds no triangles|no STL file"):
        read_surfaces(tmp_path / "a.stl", 1.0, False, tmp_path, 64)


def test_colours_are_told_of_not_read(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "box.stl", VERTICES, FACES)
    data = path.read_bytes()
    path.write_bytes(b"COLOR=\xff\0\0\xff" + data[10:])
    _, notes = read_surfaces(path, 1.0, False, tmp_path, 64)
    assert notes == ["Its colours are not read: programs disagree on them. Import it as another format."]


def test_loops_that_never_end_are_told_at_once(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_text("solid a\n" + "outer loop\n" * 300_000 + "endsolid\n")
    with pytest.raises(InputError, match="holds no triangles"):
        read_surfaces(tmp_path / "a.stl", 1.0, False, tmp_path, 64)
