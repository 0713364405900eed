"""Messages between torc and the servers of networks: msgpack, with arrays as NVIDIA's servers write them.

Three forms of arrays are read: those of msgpack-numpy (GraspGen), openpi and GR00T; the first is written. Nothing is
ever unpickled, unlike in msgpack-numpy's own decoder: a message is data, whoever sent it.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from io import BytesIO
from typing import Any

import numpy as np

from torc import TorcError
from torc.errors import MissingDependencyError, extra_remedy

MAX_BYTES = 2**28
"""Longest message by default."""
_KINDS = "biuf"
"""Booleans, whole numbers and floats: no objects, records, texts or times."""


class WireError(TorcError):
    """A message cannot be sent or read."""


def library(name: str) -> Any:
    """Import zmq or msgpack. Raises MissingDependencyError if it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingDependencyError("Talking to a network's server", extra_remedy("networks")) from error


def encode(message: Mapping[str, Any], max_bytes: int = MAX_BYTES) -> bytes:
    """Pack a message of plain data and arrays (kinds b, i, u and f; little-endian, C order).

    Raises WireError for anything else and for messages that are too long, MissingDependencyError without msgpack.
    """
    try:
        packed: bytes = library("msgpack").packb(message, default=_encoded, use_bin_type=True)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise WireError(f"this message cannot be sent: {error}.") from error
    if len(packed) > max_bytes:
        raise WireError(f"this message has {len(packed)} bytes; {max_bytes} is the limit.")
    return packed


def decode(packed: bytes) -> dict[str, Any]:
    """Unpack a message: plain data, and writable arrays in the machine's byte order. Raises WireError for junk."""
    msgpack = library("msgpack")
    try:
        message = msgpack.unpackb(packed, strict_map_key=False, object_pairs_hook=_decoded)
    except Exception as error:  # a stranger's bytes may break msgpack and numpy in any way
        raise WireError(f"the message cannot be read: {type(error).__name__} {error}.") from error
    if not isinstance(message, dict):
        raise WireError(f"a message is a map, not a {type(message).__name__}.")
    return message


def _encoded(value: Any) -> Any:
    """Return what msgpack can pack: numpy's numbers as plain ones, arrays in msgpack-numpy's form."""
    if not isinstance(value, np.ndarray | np.generic) or value.dtype.kind not in _KINDS:
        raise TypeError(f"a {type(value).__name__} is neither plain data nor an array of numbers")
    if isinstance(value, np.generic):
        return value.item()
    dtype = value.dtype.newbyteorder("<")
    data = value.astype(dtype, order="C", copy=False).tobytes()
    return {b"nd": True, b"type": dtype.str, b"kind": b"", b"shape": list(value.shape), b"data": data}


def _decoded(pairs: Sequence[tuple[Any, Any]]) -> Any:
    """Return a map, or the array or number that it stands for. Some servers write its keys as bytes."""
    form = {k.decode() if isinstance(k, bytes) else str(k): v for k, v in pairs}
    if "nd" in form:  # msgpack-numpy
        array = _array(form["type"], form["shape"] if form["nd"] else [], form["data"])
        return array if form["nd"] else array.item()
    if "__ndarray__" in form:  # openpi
        return _array(form["dtype"], form["shape"], form["data"])
    if "__npgeneric__" in form:  # openpi, a single number
        return form["data"]
    if "__ndarray_class__" in form:  # GR00T: a file as np.save writes it
        return _native(np.lib.format.read_array(BytesIO(form["as_npy"]), allow_pickle=False))
    return form


def _array(dtype: Any, shape: Any, data: Any) -> np.ndarray:
    kind = np.dtype(dtype.decode() if isinstance(dtype, bytes) else dtype)
    return _native(np.frombuffer(data, kind).reshape(shape))


def _native(array: np.ndarray) -> np.ndarray:
    """Return a writable copy in the machine's byte order. Raises TypeError if it does not hold plain numbers."""
    if array.dtype.kind not in _KINDS:
        raise TypeError(f"an array holds {array.dtype}, and only numbers are read")
    if array.dtype.kind == "b":
        # Any other byte would be a truth value that is neither true nor false.
        return np.asarray(array.view(np.uint8) != 0)
    return array.astype(array.dtype.newbyteorder("="), order="C", copy=True)
