"""OBJ files in the plainest form: what their parsers disagree on or leave out is written out before they see it."""

import re
from dataclasses import dataclass

import numpy as np

from torc.scenes.importing.reading.polygons import triangulated

_LIBRARY = re.compile(rb"^mtllib[ ]+(.*?)[ ]*$", re.MULTILINE)
_LIBRARIES = re.compile(rb"\S.*?\.mtl(?= |$)", re.IGNORECASE)
_END_COMMENT = re.compile(rb"^((?:v|vt|vn|f) [^#\n]*)#[^\n]*", re.MULTILINE)
_POLYGON_OR_RELATIVE = re.compile(rb"^f(?: +\S+){4}|^f[^\n]*[ /]-", re.MULTILINE)
_COUNTED = (b"v", b"vt", b"vn")


@dataclass(frozen=True)
class PlainObj:
    """An OBJ file without polygons, relative indices, tabs, continued lines, and comments behind numbers.

    Attributes:
        text: the file; it names one material library, `LIBRARY`, if it has any.
        libraries: the files that stand for it.
    """

    LIBRARY = "materials.mtl"
    text: bytes
    libraries: tuple[str, ...]


def plain_obj(data: bytes) -> PlainObj:
    """The same surfaces in the plainest form. Raises ValueError or IndexError if the file is none."""
    text = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ").replace(b"\t", b" ")
    text = re.sub(rb"^ +", b"", text, flags=re.MULTILINE)
    text = _END_COMMENT.sub(rb"\1", text)
    libraries = tuple(dict.fromkeys(name for line in _LIBRARY.findall(text) for name in _names(line)))
    if libraries:
        text = b"mtllib " + PlainObj.LIBRARY.encode() + b"\n" + _LIBRARY.sub(b"", text)
    if _POLYGON_OR_RELATIVE.search(text):
        text = _with_plain_faces(text)
    return PlainObj(text, tuple(name.decode("utf-8", "replace") for name in libraries))


def _names(line: bytes) -> list[bytes]:
    """One name, which may have spaces in it, or several that end in .mtl."""
    several = _LIBRARIES.findall(line)
    return several if len(several) > 1 else [line]


def _with_plain_faces(text: bytes) -> bytes:
    """Triangles for polygons, and absolute indices for those that count back from where they stand."""
    lines = text.split(b"\n")
    points: list[list[bytes]] = []
    rows: list[int] = []
    polygons: list[list[bytes]] = []
    counts = dict.fromkeys(_COUNTED, 0)
    for i, line in enumerate(lines):
        word, _, rest = line.partition(b" ")
        if word in counts:
            counts[word] += 1
            if word == b"v":
                points.append(rest.split(None, 3)[:3])
        elif word == b"f":
            rows.append(i)
            polygons.append([_absolute(corner, counts) for corner in rest.split()])
    corners = [corner for polygon in polygons for corner in polygon]
    index = np.array([int(corner.split(b"/", 1)[0]) - 1 for corner in corners], np.int64)
    vertices = np.array(points, dtype=np.float64).reshape(-1, 3)
    if len(index) and (index.min() < 0 or index.max() >= len(vertices)):
        raise ValueError(f"a face uses a corner beyond the {len(vertices)} vertices")
    triangles, owners = triangulated(vertices, np.array([len(p) for p in polygons]), index)
    for row in rows:
        lines[row] = b""
    for (a, b, c), owner in zip(triangles.tolist(), owners.tolist()):
        lines[rows[owner]] += b"f " + corners[a] + b" " + corners[b] + b" " + corners[c] + b"\n"
    return b"\n".join(lines)


def _absolute(corner: bytes, counts: dict[bytes, int]) -> bytes:
    """A face's corner, "v", "v/vt", "v//vn" or "v/vt/vn", without negative indices."""
    if b"-" not in corner:
        return corner
    parts = corner.split(b"/")
    for k, (kind, part) in enumerate(zip(_COUNTED, parts)):
        if part.startswith(b"-"):
            parts[k] = b"%d" % (counts[kind] + 1 + int(part))
    return b"/".join(parts)
