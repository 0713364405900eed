"""The example planner keeps to the rules."""

import pytest

from nearest_planner import Nearest
from torc.testing.planner_conformance import CASES, check_case


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_conforms(case):
    check_case(Nearest, case)
