"""Arrays from strangers: nothing is unpacked before its size is known to be allowed."""

import struct
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from torc.errors import InputError
from torc.files.reading import ArraySpec, read_arrays

ROWS = 1000
SPECS = {name: ArraySpec("f", 3, ROWS) for name in ("a", "b", "c")}
ONE = ROWS * 3 * 8 + 128
"""Bytes of one such array at its limit."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "arrays.npz"


@contextmanager
def _never(monkeypatch: pytest.MonkeyPatch, name: str) -> Iterator[None]:
    """Where that method of an archive must not be called."""
    with monkeypatch.context() as patch:
        patch.setattr(zipfile.ZipFile, name, lambda *_: pytest.fail(f"{name} was called"))
        yield


def test_arrays_within_all_limits_are_read(file: Path) -> None:
    arrays = {name: np.random.default_rng(0).random((ROWS, 3)) for name in SPECS}
    np.savez_compressed(file, **arrays)
    found = read_arrays(file, SPECS, 3 * ONE, "a test")
    assert all(np.array_equal(found[name], arrays[name]) for name in SPECS)


def test_arrays_that_together_unpack_to_too_much_are_refused(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez_compressed(file, **{name: np.zeros((ROWS, 3)) for name in SPECS})
    assert file.stat().st_size < ONE
    with (
        _never(monkeypatch, "open"),
        pytest.raises(InputError, match=rf"unpacks to {3 * ONE} bytes in all; at most {3 * ONE - 1}"),
    ):
        read_arrays(file, SPECS, 3 * ONE - 1, "a test")


def test_an_archive_that_understates_its_arrays_is_refused(file: Path) -> None:
    np.savez_compressed(file, **{name: np.zeros((ROWS, 3)) for name in SPECS})
    data, at = bytearray(file.read_bytes()), -1
    while (at := data.find(b"PK\1\2", at + 1)) >= 0:  # unpacked size, in the list of contents
        data[at + 24 : at + 28] = struct.pack("<L", 500)
    file.write_bytes(data)
    with pytest.raises(InputError, match=r"arrays\.npz"):
        read_arrays(file, SPECS, 2 * ONE, "a test")
