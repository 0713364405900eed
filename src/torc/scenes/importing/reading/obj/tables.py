"""What is in an OBJ file (Wavefront): its corners, and its faces with the material of each."""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from torc.scenes.importing.reading.limits import MAX_PARTS
from torc.scenes.importing.reading.obj.materials import material_name
from torc.scenes.importing.reading.texts import named_file, number_rows, plain_text, without_comment

_COMMENT = re.compile(rb"^#[^\n]*", re.MULTILINE)
_LIBRARY_END = re.compile(rb"\.mtl +", re.IGNORECASE)
_BRIGHTEST = 2.0
"""Fractions may be a little above 1, by rounding or by light."""
_OF_NUMBERS = (b"v", b"vt", b"f")


class ObjError(ValueError):
    """The file is not what its format says; the text tells where."""


@dataclass(frozen=True, eq=False)
class ObjTables:
    """An OBJ file's content.

    Attributes:
        vertices: corners.
        colours: of the corners, 0 to 1; rows of those without are not a number. None: no corner has one.
        coordinates: texture coordinates, v up.
        lengths: corners of each face.
        corners: rows of `vertices`, face after face.
        wedges: rows of `coordinates`, as `corners`; -1 where a corner has none.
        materials: of each face, as an index of `names`; -1: none.
        names: the materials that are used.
        libraries: the files that they are in.
    """

    vertices: Float[np.ndarray, "n 3"]
    colours: Float[np.ndarray, "n 3"] | None
    coordinates: Float[np.ndarray, "t 2"]
    lengths: Int[np.ndarray, "k"]
    corners: Int[np.ndarray, "c"]
    wedges: Int[np.ndarray, "c"]
    materials: Int[np.ndarray, "k"]
    names: tuple[bytes, ...]
    libraries: tuple[str, ...]


class _Lines:
    """The lines of a file, sorted by what they say."""

    def __init__(self, text: bytes) -> None:
        self.vertices: list[bytes] = []
        self.coordinates: list[bytes] = []
        self.faces: list[bytes] = []
        self.seen: list[tuple[int, int]] = []  # vertices and coordinates before each face
        self.materials: list[int] = []
        self.names: dict[bytes, int] = {}
        self.libraries: dict[str, None] = {}
        material = -1
        for line in text.split(b"\n"):
            word, _, rest = line.partition(b" ")
            if b"#" in rest and word in _OF_NUMBERS:
                rest = without_comment(rest)
            if word == b"v":
                self.vertices.append(rest)
            elif word == b"vt":
                self.coordinates.append(rest)
            elif word == b"f":
                self.faces.append(rest)
                self.seen.append((len(self.vertices), len(self.coordinates)))
                self.materials.append(material)
            elif word == b"usemtl":
                material = self.names.setdefault(material_name(rest), len(self.names))
                if len(self.names) > MAX_PARTS:
                    raise ObjError(f"it has more than {MAX_PARTS} materials; join some")
            elif word == b"mtllib":
                self.libraries.update(dict.fromkeys(_library_names(rest)))


def read_obj_tables(data: bytes) -> ObjTables:
    """The tables. Raises ObjError."""
    text = _COMMENT.sub(b"", re.sub(rb"^ +", b"", plain_text(data), flags=re.MULTILINE))
    lines = _Lines(text.replace(b"\\\n", b" "))
    try:
        numbers = number_rows(lines.vertices, 7)
        coordinates = number_rows(lines.coordinates, 2)
        lengths, corners, wedges = _faces(lines)
    except ValueError as error:
        raise ObjError(str(error).replace("\n", " ")[:200]) from None
    corners = _absolute(corners, lengths, [v for v, _ in lines.seen])
    wedges = _absolute(wedges, lengths, [t for _, t in lines.seen])
    count = len(numbers)
    if len(corners) and (corners.min() < 0 or corners.max() >= count):
        raise ObjError(f"a face uses a corner beyond the {count} vertices")
    wedges[(wedges < 0) | (wedges >= len(coordinates))] = -1
    return ObjTables(
        numbers[:, :3],
        _colours(numbers),
        np.where(np.isfinite(coordinates), coordinates, 0.0),
        lengths,
        corners,
        wedges,
        np.array(lines.materials, np.int64),
        tuple(lines.names),
        tuple(lines.libraries),
    )


def _library_names(rest: bytes) -> list[str]:
    """One name, which may have spaces in it, or several that end in .mtl."""
    whole = named_file(rest)
    parts = _LIBRARY_END.split(whole)
    names = (
        [part + b".mtl" for part in parts[:-1]] + parts[-1:] if parts[-1][-4:].lower() == b".mtl" else [whole]
    )
    return [name.decode("utf-8", "replace") for name in names if name]


def _colours(numbers: Float[np.ndarray, "n 7"]) -> Float[np.ndarray, "n 3"] | None:
    """Of vertices that have three numbers more: red, green, blue, as fractions or up to 255."""
    colours = numbers[:, 3:6]
    there = np.isfinite(colours).all(axis=1)
    if not there.any():
        return None
    most = 255.0 if colours[there].max() > _BRIGHTEST else 1.0
    return np.where(there[:, None], np.clip(colours / most, 0.0, 1.0), np.nan)


def _faces(lines: _Lines) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners of each face; and the numbers of vertices and coordinates as in the file, 0 for none."""
    words = [face.split() for face in lines.faces]
    lengths = np.fromiter(map(len, words), np.int64, len(words))
    flat = [corner for face in words for corner in face]
    slashes = np.fromiter((corner.count(b"/") for corner in flat), np.int64, len(flat))
    doubled = np.fromiter((b"//" in corner for corner in flat), bool, len(flat))
    vertices, coordinates = np.zeros((2, len(flat)), np.int64)
    for count, double in sorted({*zip(slashes.tolist(), doubled.tolist())}):
        which = np.flatnonzero((slashes == count) & (doubled == double))
        table = _corner_numbers([flat[i] for i in which], count, double)
        vertices[which] = table[:, 0]
        if count and not double:
            coordinates[which] = table[:, 1]
    return lengths, vertices, coordinates


def _corner_numbers(corners: list[bytes], slashes: int, double: bool) -> Int[np.ndarray, "n k"]:
    """Corners of one form as rows: "v", "v/vt", "v//vn", "v/vt/vn", and those that end in a slash."""
    if slashes > 2:
        raise ObjError(f"a face has the corner '{corners[0][:40].decode('utf-8', 'replace')}'")
    if any(corner.endswith(b"/") for corner in corners):  # rare: the last number is left out
        corners = [corner + b"0" if corner.endswith(b"/") else corner for corner in corners]
    joined = b" ".join(corners).replace(b"//", b"/") if double else b" ".join(corners)
    try:
        numbers = np.array(joined.replace(b"/", b" ").split(), dtype=np.int64)
        return numbers.reshape(len(corners), slashes + 1 - double)
    except (ValueError, OverflowError):
        raise ObjError("a face has a corner that is no number of a vertex") from None


def _absolute(numbers: np.ndarray, lengths: np.ndarray, seen: list[int]) -> np.ndarray:
    """Rows from 0; negative numbers in the file count back from where they stand, 0 stands for none."""
    before = np.repeat(np.array(seen, np.int64), lengths)
    rows = np.where(numbers < 0, before + numbers, numbers - 1)
    return np.where((numbers < 0) & (rows < 0), -1, rows)
