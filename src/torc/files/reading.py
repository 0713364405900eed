"""Files and arrays from strangers: nothing is allocated before its size is known to be allowed."""

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

_MAX_MEMBERS, _MEMBER_SIGNATURE = 2000, b"PK\1\2"
"""Where an archive lists its contents, every entry starts so."""
_NPY_HEADER_BYTES = 128
"""What numpy writes before the data of a plain array; longer headers belong to records, which are refused."""
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
    # Counted before zipfile reads the list, which takes seconds if the file holds little else.
    count = data.count(_MEMBER_SIGNATURE)
    if count > _MAX_MEMBERS:
        raise InputError(
            f"{path} is no plain file of arrays: it lists {count} members; at most {_MAX_MEMBERS} are allowed. "
            "Write it with numpy.savez_compressed."
        )
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {m.filename.removesuffix(".npy"): m for m in archive.infolist()}
            if set(members) != set(specs):
                odd = [name[:80] for name in sorted(set(members) ^ set(specs))[:4]]
                raise InputError(
                    f"{path} does not hold the arrays it should; missing or not expected: {', '.join(odd)}."
                )
            unpacked = sum(m.file_size for m in members.values())  # no more is unpacked, true or not
            if unpacked > max_bytes:
                raise InputError(
                    f"{path} unpacks to {unpacked} bytes in all; at most {max_bytes} are allowed for {what}."
                )
            return {name: _read_array(archive, members[name], spec, path) for name, spec in specs.items()}
    except (zipfile.BadZipFile, EOFError, OSError, zlib.error, NotImplementedError, RuntimeError) as error:
        raise InputError(f"{path} is not a readable .npz file: {error}.") from None


def _read_array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, spec: ArraySpec, path: Path) -> np.ndarray:
    where = f"{path}, array {member.filename}"
    limit = _NPY_HEADER_BYTES + 8 * spec.columns * spec.max_rows
    if member.file_size > limit:
        raise InputError(
            f"{where} unpacks to {member.file_size} bytes; at most {spec.max_rows} rows are allowed."
        )
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError(
            f"{where} is packed in a way that is not read here. Write it with numpy.savez_compressed."
        )
    with archive.open(member) as stream:
        content = stream.read(limit)
    buffer = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(buffer)
        if version != (1, 0):
            raise ValueError(f"version {version} of the array format; need (1, 0)")
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(buffer)
    except (ValueError, SyntaxError, EOFError, RecursionError, MemoryError, tokenize.TokenError) as error:
        raise InputError(f"{where} is no plain array: {error}.") from None
    wide = dtype.itemsize <= 8 and dtype.kind == spec.kind and dtype.isnative
    if (
        fortran
        or not wide
        or len(shape) != 2
        or shape[1] != spec.columns
        or not 0 < shape[0] <= spec.max_rows
    ):
        raise InputError(
            f"{where} is {dtype} {shape}; need kind '{spec.kind}', 1 to {spec.max_rows} rows of {spec.columns}."
        )
    body = content[buffer.tell() :]
    if len(body) != shape[0] * shape[1] * dtype.itemsize:
        raise InputError(f"{where} is cut off: {len(body)} bytes for {dtype} {shape}.")
    array = np.frombuffer(body, dtype).reshape(shape)
    if spec.kind == "i":
        if array.min() < 0 or array.max() >= 2**31:
            raise InputError(f"{where} holds numbers that are no indices.")
        return array.astype(np.int32)
    if not (np.abs(array) < _MAX_NUMBER).all():
        raise InputError(f"{where} holds numbers that are not finite, or beyond {_MAX_NUMBER:g}.")
    return array.astype(np.float64)
