"""One inspector for all tests of this directory."""

import pytest

from torc.generation.generator import inspector_for


@pytest.fixture(scope="session")
def inspector():
    return inspector_for()
