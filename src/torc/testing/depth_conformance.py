"""Check what every depth must do: `check_depth(MyDepth)`."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from torc.perception.checked_scenes import observation_faults
from torc.perception.protocol import Depth
from torc.perception.stereo import made_up_pair
from torc.records import Observation
from torc.registry.context import BuildContext
from torc.registry.kinds import DEPTHS
from torc.testing.conformance import called_twice, made, require, trait_faults, unit_faults
from torc.testing.contexts import box, small_mount
from torc.testing.synthetic import synthetic_observation
from torc.workspace.workspace_files import load_workspace


def check_depth(make: Callable[..., Depth]) -> None:
    """Measure a snapshot of two boxes twice, with `workspace` if the class takes it. Raises NonConformanceError."""
    shapes = (box(0, 0.72, -0.1, (0.06, 0.06, 0.2)), box(1, 0.60, -0.1, (0.06, 0.08, 0.12)))
    given = synthetic_observation(shapes, small_mount())
    given = replace(given, pair=made_up_pair(given.depth_m, float(given.K[0, 0])))
    depth = made(make, BuildContext(workspace=load_workspace()))
    measured, found = called_twice(lambda: depth.measure(given), given, "the observation")
    found += [fault for observation in measured for fault in observation_faults(observation, "measure()")]
    found += trait_faults(DEPTHS, depth)
    require("depth", found or _faults(measured[0], measured[1], given))


def _faults(measured: Observation, again: Observation, given: Observation) -> list[str]:
    found = []
    if not np.array_equal(measured.depth_m, again.depth_m, equal_nan=True):
        found.append("the same snapshot gave two different depths")
    if not np.array_equal(measured.T_world_camera, given.T_world_camera):
        found.append("it moved the camera: T_world_camera must stay as it is")
    return found + unit_faults(measured.depth_m)
