"""Check what every grasp planner must do: `check_case(MyGraspPlanner, case)` for each of CASES, or all at once with
`check_grasp_planner(MyGraspPlanner)`.

Both raise NonConformanceError, which lists what was broken. The class is made as `torc run --grasps` makes it: with
`gripper` and `support_z_m`, if it has parameters of these names. The quality of the grasps is not judged here.
"""

import pickle
from collections.abc import Callable

import numpy as np

from torc.grasping.protocol import GraspPlanner, grasp_faults
from torc.records import GraspSet
from torc.registry.context import BuildContext
from torc.robots.loading import load_robot
from torc.testing.conformance import Case, called_twice, made, require
from torc.testing.contexts import box
from torc.testing.views import View, view_of, view_of_clutter
from torc.workspace.workspace_files import load_workspace

_BASE, _TOP = box(0, 0.65, -0.1, (0.12, 0.12, 0.06)), box(1, 0.65, -0.1, (0.05, 0.05, 0.06), on=0.06)
_BACK, _FRONT = box(0, 0.72, -0.1, (0.06, 0.06, 0.2)), box(1, 0.60, -0.1, (0.06, 0.08, 0.12))

CASES: tuple[Case, ...] = (
    Case("a single box", lambda: view_of(box(1, 0.62, -0.10, (0.05, 0.06, 0.10)))),
    Case("one behind another", lambda: view_of(_BACK, _FRONT)),
    Case("one on another", lambda: view_of(_BASE, _TOP)),
    Case("too wide for the gripper", lambda: view_of(box(0, 0.65, -0.1, (0.2, 0.2, 0.15)))),
    Case("too small to tell", lambda: view_of(box(0, 0.65, -0.1, (0.008, 0.008, 0.008)))),
    Case("nothing in sight", view_of),
    Case("clutter", lambda: view_of_clutter(seed=5, n=9)),
)


def check_grasp_planner(make: Callable[..., GraspPlanner], cases: tuple[Case, ...] = CASES) -> None:
    """Run all cases with fresh planners. Raises NonConformanceError with everything that was broken."""
    require("grasp planner", [f"{case.name}: {text}" for case in cases for text in _violations(make, case)])


def check_case(make: Callable[..., GraspPlanner], case: Case) -> None:
    """Run one case. Raises NonConformanceError with everything that was broken."""
    check_grasp_planner(make, (case,))


def _violations(make: Callable[..., GraspPlanner], case: Case) -> list[str]:
    view: View = case.build()
    context = BuildContext(
        gripper=load_robot().gripper, support_z_m=load_workspace().support_z_m, workspace=load_workspace()
    )
    planned, found = called_twice(
        lambda: made(make, context).plan(view.scene, view.volume, np.random.default_rng(0)),
        (view.scene, view.volume),
        "the scene or the volume",
    )
    if planned:
        found += list(grasp_faults(planned[0], view.scene)) or _order_faults(planned[0])
    if not found and pickle.dumps(planned[0]) != pickle.dumps(planned[1]):
        found.append("the same rng gave two different sets of grasps")
    return found


def _order_faults(grasps: GraspSet) -> list[str]:
    for k in np.unique(grasps.object_ids).tolist():
        if (np.diff(grasps.scores[grasps.object_ids == k]) > 0).any():
            return [f"the grasps of object {k} are not sorted: the best of each object come first"]
    return []
