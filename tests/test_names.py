"""`import torc` is light, and its names lead home."""

import subprocess
import sys

import pytest

import torc


@pytest.mark.parametrize("name", torc.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(torc, name).__name__ == name


def test_unknown_names_are_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        torc.nonsense  # noqa: B018


def test_nothing_heavy_is_imported_at_once() -> None:
    code = "import sys, torc; print(sorted(m for m in ('numpy', 'numba', 'mujoco') if m in sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
