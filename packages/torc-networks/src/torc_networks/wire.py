"""Messages between torc and the servers of networks: msgpack, with arrays as NVIDIA's servers write them.

Three forms of arrays are read: msgpack-numpy's (GraspGen), openpi's and GR00T's. The first one is written. Nothing is
ever unpickled, as msgpack-numpy's own decoder does: a message is data, whoever sent it.
"""

import math
import re
from collections.abc import Mapping
from io import BytesIO
from typing import Any

import numpy as np

from torc import TorcError
from torc.errors import MissingDependencyError, extra_remedy

MAX_BYTES = 2**28
"""Longest message by default."""
MAX_DEPTH = 12
"""Maps and lists within each other, at most."""
_MAX_ITEMS = 2**16
"""Of one list or map: what is longer is sent as an array."""
_MAX_TEXT = 2**20
_MAX_AXES = 8
_MAX_HEADER = 4096
_DTYPE = re.compile(r"[<>|=]?(b1|[iu][1248]|f[248])")
"""Booleans, whole numbers and floats: no objects, records, texts or times."""


class WireError(TorcError):
    """A message cannot be sent, or is none that may be read."""


def encode(message: Mapping[str, Any], max_bytes: int = MAX_BYTES) -> bytes:
    """A message of plain data and arrays (kinds b, i, u and f; little-endian, C order).

    Raises WireError for anything else and for messages that are too long, MissingDependencyError without msgpack.
    """
    try:
        packed: bytes = _msgpack().packb(message, default=_encoded, use_bin_type=True)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise WireError(f"this message cannot be sent: {error}.") from error
    if len(packed) > max_bytes:
        raise WireError(f"this message has {_mb(len(packed))}; {_mb(max_bytes)} is the limit.")
    return packed


def decode(packed: bytes, max_bytes: int = MAX_BYTES) -> dict[str, Any]:
    """The message: plain data, and writable arrays in the machine's byte order.

    Raises WireError for bytes that are no message, and for what is too long, nested too deeply, or no plain numbers.
    """
    if len(packed) > max_bytes:
        raise WireError(f"the message has {_mb(len(packed))}; {_mb(max_bytes)} is the limit.")
    try:
        message = _msgpack().unpackb(
            packed,
            raw=False,
            strict_map_key=False,
            max_str_len=_MAX_TEXT,
            max_bin_len=max_bytes,
            max_array_len=_MAX_ITEMS,
            max_map_len=_MAX_ITEMS,
        )
    # msgpack's own errors are ValueErrors; keys that cannot be keys raise TypeError.
    except (ValueError, TypeError, RecursionError, MemoryError) as error:
        raise WireError(
            f"the message is no msgpack that may be read: {type(error).__name__} {error}."
        ) from error
    decoded = _decoded(message, 0)
    if not isinstance(decoded, dict):
        raise WireError(f"a message is a map, not a {type(decoded).__name__}.")
    return decoded


def _msgpack() -> Any:
    try:
        import msgpack
    except ImportError as error:
        raise MissingDependencyError("Talking to a network's server", extra_remedy("networks")) from error
    return msgpack


def _encoded(value: Any) -> Any:
    """What msgpack does not know by itself: arrays in msgpack-numpy's form, and numpy's numbers."""
    if isinstance(value, np.generic) and value.dtype.kind in "biuf":
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a {type(value).__name__} is neither plain data nor an array")
    dtype = value.dtype.newbyteorder("<")
    if not _DTYPE.fullmatch(dtype.str):
        raise TypeError(f"arrays of {value.dtype} are not sent, only booleans, whole numbers and floats")
    data = value.astype(dtype, order="C", copy=False).tobytes()
    return {b"nd": True, b"type": dtype.str, b"kind": b"", b"shape": list(value.shape), b"data": data}


def _decoded(value: Any, depth: int) -> Any:
    if depth > MAX_DEPTH:
        raise WireError(f"maps and lists lie within each other more than {MAX_DEPTH} deep.")
    if isinstance(value, list):
        return [_decoded(v, depth + 1) for v in value]
    if isinstance(value, dict):
        named = {_key(k): v for k, v in value.items()}
        if len(named) < len(value):
            raise WireError("a map has a key twice.")
        for mark, read in _FORMS.items():
            if mark in named:
                return read(named)
        return {k: _decoded(v, depth + 1) for k, v in named.items()}
    if value is None or isinstance(value, bool | int | float | str | bytes):
        return value
    raise WireError(f"a {type(value).__name__} is no plain data.")


def _key(key: Any) -> str:
    """A key as text: the servers write those of arrays as bytes."""
    if isinstance(key, bytes):
        try:
            key = key.decode("ascii")
        except UnicodeDecodeError:
            raise WireError("a key is neither text nor ASCII.") from None
    if not isinstance(key, str):
        raise WireError(f"a {type(key).__name__} is no key.")
    return key


def _msgpack_numpy(form: Mapping[str, Any]) -> Any:
    """{nd: True, type, kind, shape, data}; a single number with nd: False."""
    if form.get("kind", b"") not in (b"", ""):
        raise WireError("an array holds objects or records, and only numbers are read.")
    if form["nd"] is True:
        return _array(form.get("type"), form.get("shape"), form.get("data"))
    return _array(form.get("type"), [], form.get("data")).item()


def _openpi(form: Mapping[str, Any]) -> np.ndarray:
    """{__ndarray__: True, data, dtype, shape}."""
    return _array(form.get("dtype"), form.get("shape"), form.get("data"))


def _openpi_number(form: Mapping[str, Any]) -> Any:
    """{__npgeneric__: True, data, dtype}, the data a plain number."""
    if not isinstance(form.get("data"), bool | int | float):
        raise WireError("a single number is none.")
    return form["data"]


def _gr00t(form: Mapping[str, Any]) -> np.ndarray:
    """{__ndarray_class__: True, as_npy: a file as np.save writes it}."""
    data = form.get("as_npy")
    if not isinstance(data, bytes):
        raise WireError("an array has no bytes.")
    file = BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        # The header alone: np.load would make the array that it announces before any of it is there.
        shape, fortran, dtype = read[version](file, max_header_size=_MAX_HEADER)
    except Exception as error:  # a stranger's header may break numpy's reader in any way
        raise WireError(f"an array is no .npy file that may be read: {type(error).__name__}.") from error
    array = _array(dtype.str, list(shape[::-1] if fortran else shape), data[file.tell() :])
    return np.ascontiguousarray(array.T) if fortran else array


def _array(dtype: Any, shape: Any, data: Any) -> np.ndarray:
    """A writable array of exactly these bytes."""
    if isinstance(dtype, bytes):
        dtype = dtype.decode("ascii", "replace")
    if not (isinstance(dtype, str) and _DTYPE.fullmatch(dtype)):
        raise WireError(
            f"arrays of {str(dtype)[:40]!r} are not read, only booleans, whole numbers and floats."
        )
    whole = isinstance(shape, list) and all(type(n) is int and n >= 0 for n in shape)
    if not whole or len(shape) > _MAX_AXES or not isinstance(data, bytes):
        raise WireError(f"an array needs bytes and a shape of at most {_MAX_AXES} whole numbers.")
    kind = np.dtype(dtype)
    needed = math.prod(shape) * kind.itemsize
    if needed != len(data) or max(shape, default=0) >= 2**31:
        raise WireError(f"an array of shape {tuple(shape)} needs {needed} bytes; it has {len(data)}.")
    flat = np.frombuffer(data, kind)
    if kind.kind == "b":
        # Any other byte would be a truth value that is neither true nor false.
        flat = flat.view(np.uint8) != 0
    return flat.reshape(shape).astype(kind.newbyteorder("="), copy=True)


def _mb(size: int) -> str:
    return f"{size / 2**20:.1f} MB"


_FORMS = {
    "nd": _msgpack_numpy,
    "__ndarray__": _openpi,
    "__npgeneric__": _openpi_number,
    "__ndarray_class__": _gr00t,
}
