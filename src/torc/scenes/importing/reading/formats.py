"""What format the content of a mesh file is of, whatever its name says."""

import re

from torc.scenes.importing.reading.texts import plain_text

_OBJ_LINE = re.compile(
    rb"^[ \t]*(v[ \t]+[-+.\d]|f[ \t]+\d|(mtllib|usemtl)[ \t]+\S|o[ \t]+\S+[ \t]*\r?$)", re.MULTILINE
)
_STL_FACET = re.compile(rb"\n[ \t]*facet\b")
_GLB_HEADER_BYTES = 20
STL_HEADER_BYTES, STL_TRIANGLE_BYTES = 84, 50
_MAX_STL_SURPLUS_BYTES = STL_TRIANGLE_BYTES - 1
"""Some programs write a few bytes behind the last triangle."""


def is_format(data: bytes, kind: str) -> bool:
    """Whether the bytes are a whole file of a format ("glb", "obj", "ply", "stl"), which may be empty of triangles.

    Only what the format itself tells is looked at: an OBJ may end anywhere, and the elements of a PLY are not counted.
    """
    return {"glb": _is_glb, "obj": _is_obj, "ply": _is_ply, "stl": _is_stl}[kind](data)


def no_such_format(data: bytes, kind: str) -> str:
    """The end of a sentence on a file that is not `is_format`, with the remedy."""
    found = next((other for other in ("glb", "ply", "stl", "obj") if is_format(data, other)), None)
    remedy = "Get it again" if found is None else f"It looks like {found.upper()}: rename it to .{found}"
    return f"is no {kind.upper()} file, or is cut off. {remedy}."


def _is_glb(data: bytes) -> bool:
    whole = len(data) >= max(_GLB_HEADER_BYTES, int.from_bytes(data[8:12], "little"))
    return data[:4] == b"glTF" and whole


def _is_obj(data: bytes) -> bool:
    text = plain_text(data)
    return b"\0" not in text and _OBJ_LINE.search(text) is not None


def _is_ply(data: bytes) -> bool:
    return data[:3] == b"ply" and b"end_header" in data


def is_binary_stl(data: bytes) -> bool:
    """Whether the bytes are as many as a binary STL file says."""
    triangles = int.from_bytes(data[STL_HEADER_BYTES - 4 : STL_HEADER_BYTES], "little")
    surplus = len(data) - STL_HEADER_BYTES - STL_TRIANGLE_BYTES * triangles
    if surplus <= 0 or triangles == 0:
        return surplus == 0
    return surplus <= _MAX_STL_SURPLUS_BYTES or not data[-surplus:].strip(b"\0")


def _is_stl(data: bytes) -> bool:
    if is_binary_stl(data):
        return True
    text = data.replace(b"\r", b"\n").lstrip().lower()  # the other kind of STL is text
    _, end, rest = text.rpartition(b"endsolid")  # of several solids the last, too, must be whole
    return text.startswith(b"solid") and end != b"" and _STL_FACET.search(rest) is None
