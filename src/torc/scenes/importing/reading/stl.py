"""The surfaces of STL files, binary and text."""

import re
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.scenes.importing.reading.formats import STL_HEADER_BYTES, STL_TRIANGLE_BYTES, is_binary_stl
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import Surface

_LOOP_END = re.compile(rb"\bendloop\b", re.IGNORECASE)
_LOOP = re.compile(
    rb"\bouter\s+loop\s+" + rb"\s+".join([rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)"] * 3) + rb"\s*\Z", re.IGNORECASE
)
_FACET = re.compile(rb"\bfacet\s+normal\b", re.IGNORECASE)


def read_stl(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surface of an STL file. See `SurfaceReader`."""
    binary = is_binary_stl(data)
    if binary and b"COLOR=" in data[:STL_HEADER_BYTES]:
        reading.note("Its colours are not read: programs disagree on them. Import it as another format.")
    corners = _binary(data) if binary else _text(data, reading)
    yield Surface(corners, np.arange(len(corners)).reshape(-1, 3))


def _binary(data: bytes) -> Float[np.ndarray, "n 3"]:
    count = int.from_bytes(data[STL_HEADER_BYTES - 4 : STL_HEADER_BYTES], "little")
    rows = np.frombuffer(data, np.uint8, STL_TRIANGLE_BYTES * count, STL_HEADER_BYTES)
    numbers = rows.reshape(count, STL_TRIANGLE_BYTES)[:, :48].copy().view("<f4")
    with np.errstate(invalid="ignore"):
        return numbers[:, 3:].reshape(-1, 3).astype(np.float64)  # the first three are the normal


def _text(data: bytes, reading: Reading) -> Float[np.ndarray, "n 3"]:
    text = data.replace(b"\r", b"\n")
    loops = [_LOOP.search(part) for part in _LOOP_END.split(text)[:-1]]
    facets = len(_FACET.findall(text))
    numbers = [match.groups() for match in loops if match is not None]
    try:
        if len(numbers) != facets or len(loops) != facets:
            raise ValueError(f"{facets} facets, of which {len(numbers)} have three corners")
        return np.array(numbers, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise InputError(f"{reading.path} is not a readable STL file: {error}. Export it again.") from None
