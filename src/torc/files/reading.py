"""Files and arrays from strangers: plain, no pickle, and no larger than they may be."""

import io
import os
import stat
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from torc.errors import InputError

_UNREADABLE = (
    zipfile.BadZipFile,
    zlib.error,
    tokenize.TokenError,
    EOFError,
    OSError,
    ValueError,
    SyntaxError,
    NotImplementedError,
    RuntimeError,
    MemoryError,
)
"""What numpy and zipfile raise for damaged files."""
_MAX_NUMBER = 1e30
"""Larger ones do not fit the single precision of physics and pictures."""


@dataclass(frozen=True)
class ArraySpec:
    """What an array in a file must be.

    Attributes:
        kind: "f" for floats (they must be finite, and not huge), "i" for integers.
        columns: its second dimension; the first is free.
        max_rows: upper limit of the first dimension.
    """

    kind: str
    columns: int
    max_rows: int


def read_bytes(path: Path, max_bytes: int, what: str) -> bytes:
    """The content of a plain file; `what` names it in errors.

    Raises:
        InputError: missing, too large, a link, or no plain file (reading a device or a pipe could go on for ever).
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except FileNotFoundError:
        raise InputError(f"{path} is missing: that is {what}.") from None
    except OSError as error:
        if path.is_symlink():
            raise InputError(f"{path} is a link; {what} must be a file of its own. Copy it there.") from None
        raise InputError(f"{path} cannot be read: {error.strerror}.") from None
    with os.fdopen(handle, "rb") as file:
        facts = os.fstat(file.fileno())
        if not stat.S_ISREG(facts.st_mode):
            raise InputError(f"{path} is not a plain file; {what} must be one.")
        if facts.st_size > max_bytes:
            raise InputError(
                f"{path} is too large for {what}: {facts.st_size} bytes; at most {max_bytes} are allowed."
            )
        return file.read(max_bytes + 1)[:max_bytes]


def read_arrays(
    path: Path, specs: Mapping[str, ArraySpec], max_bytes: int, what: str
) -> dict[str, np.ndarray]:
    """The arrays of a .npz file: exactly those of `specs`, float64 or int32, without pickle.

    Args:
        path: the file.
        specs: what the arrays must be, one by one.
        max_bytes: of the file, and of what all arrays together unpack to.
        what: names the file's content in errors.

    Raises:
        InputError: not readable, too large (packed or unpacked), arrays missing or not asked for, wrong kinds,
            shapes or values.
    """
    data = read_bytes(path, max_bytes, what)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(member.file_size for member in archive.infolist())
        if unpacked > max_bytes:
            raise InputError(
                f"{path} unpacks to {unpacked} bytes in all; at most {max_bytes} are allowed for {what}."
            )
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            odd = sorted(set(arrays.files) ^ set(specs))
            if odd:
                raise InputError(
                    f"{path} does not hold the arrays it should; missing or not expected: {', '.join(odd[:4])[:320]}."
                )
            return {
                name: _checked(arrays[name], spec, f"{path}, array {name}") for name, spec in specs.items()
            }
    except _UNREADABLE as error:
        raise InputError(f"{path} is not a readable .npz file: {error}.") from None


def _checked(array: np.ndarray, spec: ArraySpec, where: str) -> np.ndarray:
    """The array as float64 or int32. Raises InputError if it is not what it should be."""
    if (
        not isinstance(array, np.ndarray)  # whatever has no header of an array comes as bytes
        or array.dtype.kind != spec.kind
        or array.shape[1:] != (spec.columns,)
        or not 0 < len(array) <= spec.max_rows
    ):
        is_ = f"{array.dtype} {array.shape}" if isinstance(array, np.ndarray) else "no array"
        raise InputError(
            f"{where} is {is_}; need kind '{spec.kind}', 1 to {spec.max_rows} rows of {spec.columns}."
        )
    if spec.kind == "i":
        if array.min() < 0 or array.max() >= 2**31:
            raise InputError(f"{where} holds numbers that are no indices.")
        return array.astype(np.int32)
    if not (np.abs(array) < _MAX_NUMBER).all():
        raise InputError(f"{where} holds numbers that are not finite, or beyond {_MAX_NUMBER:g}.")
    return array.astype(np.float64)
