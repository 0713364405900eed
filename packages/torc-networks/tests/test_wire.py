"""Messages come through whole, in every dialect; nothing that is no plain data ever does."""

import pickle
from contextlib import suppress
from io import BytesIO

import hypothesis.extra.numpy as arrays
import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from torc_networks.wire import WireError, decode, encode

_DTYPES = some.sampled_from(
    ["?", "|b1", "<i1", "<u1", ">i2", "<u4", ">i8", "<u8", "<f2", ">f4", "<f8", ">f8"]
)
_ARRAYS = arrays.arrays(_DTYPES, arrays.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4))
_PLAIN = (
    some.none()
    | some.booleans()
    | some.integers(-(2**63), 2**63)
    | some.floats()
    | some.text()
    | some.binary()
)
_NAMES = some.text(max_size=5).filter(
    lambda k: k not in ("nd", "__ndarray__", "__npgeneric__", "__ndarray_class__")
)
_TREES = some.recursive(
    _PLAIN | _ARRAYS, lambda t: some.lists(t, max_size=3) | some.dictionaries(_NAMES, t), max_leaves=6
)


def _same(a, b):
    if isinstance(a, np.ndarray):
        alike = a.dtype.newbyteorder("=") == b.dtype and b.flags.writeable and b.dtype.isnative
        return alike and a.shape == b.shape and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(_same(v, b[k]) for k, v in a.items())
    if isinstance(a, list):
        return len(a) == len(b) and all(map(_same, a, b))
    return type(a) is type(b) and (a == b or a != a)


@given(some.dictionaries(_NAMES, _TREES, max_size=3))
def test_messages_come_back_as_they_were(message):
    assert _same(message, decode(encode(message)))


def test_arrays_are_written_as_msgpack_numpy_writes_them():
    """Bytes by hand, after the msgpack specification and msgpack-numpy's README."""
    a = np.array([[1.0, 2.0]], "<f4")
    by_hand = (
        b"\x81\xa1a"
        b"\x85\xc4\x02nd\xc3"
        b"\xc4\x04type\xa3<f4"
        b"\xc4\x04kind\xc4\x00"
        b"\xc4\x05shape\x92\x01\x02"
        b"\xc4\x04data\xc4\x08" + a.tobytes()
    )
    assert encode({"a": a}) == by_hand
    np.testing.assert_array_equal(decode(by_hand)["a"], a)


def test_arrays_are_written_little_endian_and_in_c_order():
    a = np.arange(6, dtype=">i2").reshape(2, 3)
    for same in (a, np.asfortranarray(a), a.astype("<i2"), np.repeat(a, 2, axis=1)[:, ::2]):
        assert encode({"a": same}) == encode({"a": a.astype("<i2")})
    assert b"<i2" in encode({"a": a})


def test_a_server_that_uses_msgpack_numpy_itself_is_understood():
    theirs = pytest.importorskip("msgpack_numpy")
    message = {
        "points": np.arange(12, dtype="f4").reshape(4, 3)[::2],
        "flag": np.array([True]),
        "n": np.int32(-7),
    }
    got = decode(msgpack.packb(message, default=theirs.encode))
    np.testing.assert_array_equal(got["points"], message["points"])
    assert (got["flag"].tolist(), got["n"]) == ([True], -7)
    back = msgpack.unpackb(encode(message), object_hook=theirs.decode)
    np.testing.assert_array_equal(back["points"], message["points"])


def _packed(form, **more):
    return msgpack.packb({"a": {**form, **more}}, use_bin_type=True)


def _saved(array):
    file = BytesIO()
    np.save(file, array)
    return file.getvalue()


NUMPY_FORM = {b"nd": True, b"type": "<i2", b"kind": b"", b"shape": [2, 3], b"data": bytes(range(12))}
OPENPI_FORM = {b"__ndarray__": True, b"data": bytes(range(12)), b"dtype": "<i2", b"shape": (2, 3)}
SIX = np.frombuffer(bytes(range(12)), "<i2").reshape(2, 3)


@pytest.mark.parametrize(
    "form",
    [
        NUMPY_FORM,
        {k.decode(): v for k, v in NUMPY_FORM.items()},
        {k: v for k, v in NUMPY_FORM.items() if k != b"kind"},
        OPENPI_FORM,
        {"__ndarray_class__": True, "as_npy": _saved(SIX)},
        {"__ndarray_class__": True, "as_npy": _saved(np.asfortranarray(SIX))},
        {"__ndarray_class__": True, "as_npy": _saved(SIX.astype(">i2"))},
    ],
)
def test_every_dialect_is_read(form):
    got = decode(_packed(form))["a"]
    np.testing.assert_array_equal(got, SIX)
    assert got.dtype == np.int16


class _Bomb:
    def __reduce__(self):
        return pytest.fail, ("a message was unpickled",)


_PICKLE = pickle.dumps(_Bomb())
_OBJECTS = np.array([None])


def _npy(dtype, shape, data=b""):
    """A .npy file of version 1.0 with any header."""
    header = (
        f"{{'descr': {dtype!r}, 'fortran_order': False, 'shape': {shape!r}, }}".encode().ljust(117) + b"\n"
    )
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + data


@pytest.mark.parametrize(
    "hostile",
    [
        _packed(NUMPY_FORM, x=0) + b"\x00",
        _packed(NUMPY_FORM)[:-3],
        b"",
        b"\xc1",
        msgpack.packb([1, 2]),
        msgpack.packb({b"\xff": 2}),
        b"\x81\xa1a\xa2\xff\xfe",
        b"\xdd\x00\xff\xff\xff" * 1000,
        b"\x91" * 5000 + b"\x00",
        _packed({b"nd": True, b"kind": b"O", b"type": "|O", b"shape": [1], b"data": _PICKLE}),
        _packed({b"nd": True, b"kind": b"", b"type": "|O", b"shape": [1], b"data": _PICKLE}),
        _packed({b"nd": True, b"kind": b"V", b"type": [["x", "<f4"]], b"shape": [1], b"data": b"1234"}),
        _packed({b"nd": False, b"type": "|O8", b"data": b"12345678"}),
        _packed({b"nd": True}),
        _packed(NUMPY_FORM | {b"shape": [2, 4]}),
        _packed(NUMPY_FORM | {b"shape": [2**62, 2**62]}),
        _packed(NUMPY_FORM | {b"shape": [-2, -3]}),
        _packed(NUMPY_FORM | {b"shape": [2, 3.0]}),
        _packed(NUMPY_FORM | {b"shape": [0, 2**62, 2**62], b"data": b""}),
        _packed(NUMPY_FORM | {b"type": "<M8[s]"}),
        _packed(NUMPY_FORM | {b"type": "(6)i2,i2"}),
        _packed(NUMPY_FORM | {b"data": "text of 12.."}),
        _packed(OPENPI_FORM | {b"dtype": "|O", b"data": _PICKLE}),
        _packed({"__ndarray_class__": True, "as_npy": _saved(_OBJECTS)}),
        _packed({"__ndarray_class__": True, "as_npy": _npy("|O", (1,), _PICKLE)}),
        _packed({"__ndarray_class__": True, "as_npy": _npy("<f8", (10**12,))}),
        _packed({"__ndarray_class__": True, "as_npy": _npy("<f8", (-1,))}),
        _packed({"__ndarray_class__": True, "as_npy": _saved(SIX)[:-1]}),
        _packed({"__ndarray_class__": True, "as_npy": b"PK\x03\x04"}),
        _packed({"__ndarray_class__": True, "as_npy": b"\x93NUMPY\x03\x00"}),
        _packed({"__ndarray_class__": True}),
    ],
    ids=repr,
)
def test_hostile_bytes_are_refused(hostile):
    with pytest.raises(WireError):
        decode(hostile)


@given(some.binary(max_size=60))
def test_any_bytes_are_a_message_or_refused(junk):
    with suppress(WireError):
        assert isinstance(decode(junk), dict)


@given(some.integers(0, 300), some.integers(0, 255))
def test_a_message_with_a_wrong_byte_is_a_message_or_refused(where, byte):
    packed = bytearray(encode({"a": np.arange(20.0), "b": [1, {"c": np.zeros((2, 2), bool)}]}))
    packed[where % len(packed)] = byte
    with suppress(WireError):
        assert isinstance(decode(bytes(packed)), dict)


def test_length_has_a_limit():
    message = {"a": np.zeros(1000)}
    length = len(encode(message))
    encode(message, length)
    with pytest.raises(WireError, match="limit"):
        encode(message, length - 1)


def test_truth_values_are_true_or_false_whatever_byte_was_sent():
    got = decode(_packed({b"nd": True, b"type": "|b1", b"shape": [3], b"data": b"\x00\x01\x07"}))["a"]
    assert got.view(np.uint8).tolist() == [0, 1, 1]


@pytest.mark.parametrize(
    "value", [object(), {1, 2}, np.array(["text"]), _OBJECTS, np.zeros(1, "c8"), 2**70, 1j, "\ud800"]
)
def test_what_is_no_plain_data_is_not_sent(value):
    with pytest.raises(WireError):
        encode({"a": value})
