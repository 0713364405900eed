"""Pictures from strangers: their sizes are known before anything is unpacked, and only what makes up a picture is."""

import io
import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from torc.errors import InputError
from torc.files.reading import read_bytes

_SIGNATURE, _HEADER = b"\x89PNG\r\n\x1a\n", b"\0\0\0\rIHDR"
_NEEDED = (b"IHDR", b"PLTE", b"IDAT", b"IEND")
_MAX_CHUNKS = 20_000


@dataclass(frozen=True)
class PackedPng:
    """A PNG that is not unpacked yet.

    Attributes:
        where: names it in errors.
        width, height: pixels.
        data: the file without its comments, colour profiles and the like: packed ones can be as large as anything.
    """

    where: str
    width: int
    height: int
    data: bytes

    @property
    def pixels(self) -> int:
        """How many it has."""
        return self.width * self.height

    def unpack(self) -> UInt8[np.ndarray, "h w 3"]:
        """Its colours, transparency dropped. Raises InputError if it is damaged."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", Image.DecompressionBombWarning)
                with Image.open(io.BytesIO(self.data), formats=("PNG",)) as image:
                    return np.array(image.convert("RGB"))
        except (
            Image.DecompressionBombError,
            Image.DecompressionBombWarning,
            OSError,  # PIL's "unidentified" and "truncated" too
            SyntaxError,
            ValueError,
            EOFError,
            zlib.error,
        ) as error:
            raise _unreadable(self.where, str(error)) from None


def read_png(path: Path, max_side_px: int, max_bytes: int, what: str) -> PackedPng:
    """A PNG, its header looked at. Raises InputError if it is missing, a link, too large (in bytes or pixels), or no
    PNG."""
    data, where = read_bytes(path, max_bytes, what), str(path)
    if not data.startswith(_SIGNATURE + _HEADER) or len(data) < 33:
        raise _unreadable(where, "it does not begin like one")
    width, height = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if max(width, height) > max_side_px:
        raise InputError(
            f"{where} is {width}x{height} pixels; at most {max_side_px} a side are allowed. Scale it down."
        )
    if min(width, height) == 0:
        raise _unreadable(where, "it has no pixels")
    return PackedPng(where, width, height, _bare(data, where))


def _bare(data: bytes, where: str) -> bytes:
    """The PNG without the chunks that are not needed for its pixels."""
    kept, at, headers = [_SIGNATURE], len(_SIGNATURE), 0
    for _ in range(_MAX_CHUNKS):
        if at >= len(data):
            break
        kind, end = data[at + 4 : at + 8], at + 12 + int.from_bytes(data[at : at + 4], "big")
        if kind in _NEEDED:
            kept.append(data[at:end])  # of a cut one what there is: unpacking tells
        headers += kind == b"IHDR"
        at = len(data) if kind == b"IEND" else end
    else:
        raise _unreadable(where, f"it has more than {_MAX_CHUNKS} parts")
    if headers > 1:
        raise _unreadable(where, "it has more than one size")
    return b"".join(kept)


def _unreadable(where: str, why: str) -> InputError:
    return InputError(f"{where} is no readable picture (PNG): {why}. Save it anew as a PNG.")
