"""How the parts of a pipeline are put together."""

import pytest

from torc.pipeline.building import build_system
from torc.specs.conditions import Conditions


@pytest.mark.parametrize(("depth", "rough"), [("as-measured", False), ("sgbm", True)])
def test_grasps_promise_as_the_depth_allows(depth, rough):
    system = build_system(Conditions(depth=depth))
    assert system.pipeline.grasp_planner.config.rough_depth == rough
