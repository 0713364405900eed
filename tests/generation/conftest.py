"""One inspector, and one generated problem, for all tests of this directory."""

import pytest
from generation_configs import SMALL

from torc.generation.batch import inspector_for
from torc.generation.generator import generate_problem


@pytest.fixture(scope="session")
def inspector():
    return inspector_for()


@pytest.fixture(scope="session")
def generated(inspector):
    """Eight standing objects, from seed 3."""
    return generate_problem(SMALL, 3, inspector)
