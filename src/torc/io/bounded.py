"""JSON, pictures and arrays of untrusted files, read within bounds."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from torc.errors import InputError
from torc.io.pictures import eight_bit_picture
from torc.io.reading import read_text

MAX_PIXELS = 20_000_000
MAX_ARRAY_BYTES = 512 * 2**20


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object. Raises InputError."""
    try:
        data = json.loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"Cannot read {path}: {error}.") from error
    if not isinstance(data, dict):
        raise InputError(f"{path} must hold a JSON object, not a {type(data).__name__}.")
    return data


def read_pixels(path: Path) -> np.ndarray:
    """Of a picture: rgb.png in color, the others as they are. Raises InputError."""
    try:
        with Image.open(path) as opened:
            if opened.width * opened.height > MAX_PIXELS:
                raise ValueError(f"{opened.width}x{opened.height} pixels are too many")
            if path.name != "rgb.png":
                return np.array(opened)
            return np.array(eight_bit_picture(opened).convert("RGB"))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"Cannot read the image {path}: {error}.") from error


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """All arrays of a .npz. Raises InputError."""
    try:
        with zipfile.ZipFile(path) as archive:
            if max((member.file_size for member in archive.infolist()), default=0) > MAX_ARRAY_BYTES:
                raise InputError(f"{path} holds an array larger than {MAX_ARRAY_BYTES // 2**20} MB unpacked.")
        with np.load(path, allow_pickle=False) as data:
            return dict(data)
    except (OSError, zipfile.BadZipFile, EOFError, MemoryError, ValueError) as error:
        hint = "Python objects are not read; store plain arrays" if "pickle" in str(error) else str(error)
        raise InputError(f"Cannot read {path}: {hint}. Write it with numpy.savez_compressed.") from error
