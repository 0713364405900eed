"""A mesh file's format is known by its content."""

from pathlib import Path

import pytest
from mesh_files import box, glb_box, write_obj, write_ply, write_stl

from torc.scenes.importing.reading.formats import is_format, no_such_format

SIZE = (0.06, 0.16, 0.21)
FORMATS = ("glb", "obj", "ply", "stl")
TEXT_STL = b"solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n"
TEXT_STL += b"  endloop\n endfacet\nendsolid a\n"


def _content(kind: str, directory: Path) -> bytes:
    path = directory / f"a.{kind}"
    if kind == "glb":
        return glb_box(path, SIZE).read_bytes()
    return {"obj": write_obj, "ply": write_ply, "stl": write_stl}[kind](path, *box(SIZE)).read_bytes()


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_is_known_as_no_other(kind: str, tmp_path: Path) -> None:
    assert [other for other in FORMATS if is_format(_content(kind, tmp_path), other)] == [kind]


@pytest.mark.parametrize(
    ("kind", "content"),
    [
        ("stl", TEXT_STL),
        ("stl", TEXT_STL * 2),
        ("stl", TEXT_STL.replace(b"solid a", b"solid facet")),
        ("stl", b"solid nothing\nendsolid nothing\n"),
        ("stl", b"\0" * 84),
        ("obj", b"# points\r\nv 0 0 1\r\n"),
        ("obj", b"# made by hand\no Cube\n"),
        ("ply", b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"),
    ],
)
def test_empty_files_and_those_in_text_are_what_they_are(kind: str, content: bytes) -> None:
    assert [other for other in FORMATS if is_format(content, other)] == [kind]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"A letter of several lines,\nfor you.\nSincerely\n",
        TEXT_STL[:80],
        TEXT_STL + TEXT_STL[:80],
        b"\0\nv 0 0 0\n",
    ],
)
def test_what_is_none_is_known_as_none(content: bytes) -> None:
    assert not any(is_format(content, kind) for kind in FORMATS)
    assert no_such_format(content, "stl") == "is no STL file, or is cut off. Get it again."


def test_a_wrong_ending_is_told(tmp_path: Path) -> None:
    told = no_such_format(_content("glb", tmp_path), "obj")
    assert told == "is no OBJ file, or is cut off. It looks like GLB: rename it to .glb."
