"""Fixtures that all tests share."""

import numpy as np
import pytest


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded generator: tests are the same every time."""
    return np.random.default_rng(20260101)
