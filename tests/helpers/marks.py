"""Markers on some values of a parameter."""

from typing import Any

import pytest


def long(*values: Any) -> list[Any]:
    """Values that are tried with `-m long` alone, beside one that the default run tries."""
    return [pytest.param(value, marks=pytest.mark.long) for value in values]
