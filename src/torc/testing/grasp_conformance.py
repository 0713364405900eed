"""What every grasp planner must do, as checks that the author of one runs on it.

    import pytest
    from torc.testing.grasp_conformance import CASES, check_case

    @pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
    def test_my_grasp_planner_conforms(case):
        check_case(MyGraspPlanner, case)

or all at once: `check_grasp_planner(MyGraspPlanner)`. Both raise NonConformanceError, which lists what was broken. The
class is made as `torc run --grasps` makes it: with `gripper` and `support_z_m`, if it has parameters of these names.
How good the grasps are is not judged here: `torc run` shows it, and `torc bench` measures it.
"""

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from torc.grasping.asking import grasp_faults
from torc.grasping.protocol import GraspPlanner
from torc.plugins import parameters
from torc.records import GraspSet
from torc.robots.description import GripperDescription
from torc.robots.loading import load_robot
from torc.testing.conformance import NonConformanceError
from torc.testing.contexts import box
from torc.testing.views import View, view_of, view_of_clutter
from torc.workspace.description import Workspace

GraspPlannerFactory = Callable[..., GraspPlanner]
_TABLE_Z = Workspace().support_z_m


@dataclass(frozen=True)
class Case:
    """One scene a grasp planner must cope with.

    Attributes:
        name: for reports.
        build: makes the scene and the occlusion volume.
    """

    name: str
    build: Callable[[], View]


CASES: tuple[Case, ...] = (
    Case("a single box", lambda: view_of(box(1, 0.62, -0.10, (0.05, 0.06, 0.10)))),
    Case(
        "one behind another",
        lambda: view_of(box(0, 0.72, -0.1, (0.06, 0.06, 0.2)), box(1, 0.60, -0.1, (0.06, 0.08, 0.12))),
    ),
    Case(
        "one on another",
        lambda: view_of(
            box(0, 0.65, -0.1, (0.12, 0.12, 0.06)), box(1, 0.65, -0.1, (0.05, 0.05, 0.06), on=0.06)
        ),
    ),
    Case("too wide for the gripper", lambda: view_of(box(0, 0.65, -0.1, (0.2, 0.2, 0.15)))),
    Case("too small to tell", lambda: view_of(box(0, 0.65, -0.1, (0.008, 0.008, 0.008)))),
    Case("nothing in sight", view_of),
    Case("clutter", lambda: view_of_clutter(seed=5, n=9)),
)


def check_grasp_planner(make: GraspPlannerFactory, cases: tuple[Case, ...] = CASES) -> None:
    """Runs all cases with fresh planners. Raises NonConformanceError with everything that was broken."""
    broken = [text for case in cases for text in violations(make, case)]
    if broken:
        raise NonConformanceError(
            "This grasp planner does not conform:\n- " + "\n- ".join(dict.fromkeys(broken))
        )


def check_case(make: GraspPlannerFactory, case: Case) -> None:
    """Runs one case. Raises NonConformanceError with everything that was broken."""
    check_grasp_planner(make, (case,))


def violations(make: GraspPlannerFactory, case: Case, seed: int = 0) -> list[str]:
    """The rules that a grasp planner breaks in one case; empty if none."""
    view = case.build()
    before, drawn = pickle.dumps((view.scene, view.volume)), str(np.random.get_state())
    try:
        grasps = _made(make).plan(view.scene, view.volume, np.random.default_rng(seed))
        again = _made(make).plan(view.scene, view.volume, np.random.default_rng(seed))
    except (Exception, SystemExit) as error:  # whatever a stranger's planner raises is the finding
        return [f"{case.name}: it raised {type(error).__name__}: {error}"]
    found = list(grasp_faults(grasps, view.scene))
    if not found:
        found += _order_faults(grasps)
    if pickle.dumps((view.scene, view.volume)) != before:
        found.append("it changed the scene or the volume")
    if str(np.random.get_state()) != drawn:
        found.append("it drew from numpy's global random generator instead of rng")
    if not found and pickle.dumps(again) != pickle.dumps(grasps):
        found.append("the same rng gave two different sets of grasps")
    return [f"{case.name}: {text}" for text in found]


@cache
def _gripper() -> GripperDescription:
    return load_robot().gripper


def _made(make: GraspPlannerFactory) -> GraspPlanner:
    offered: dict[str, Any] = {"gripper": _gripper(), "support_z_m": _TABLE_Z}
    return make(**{name: value for name, value in offered.items() if name in parameters(make)})


def _order_faults(grasps: GraspSet) -> list[str]:
    for k in np.unique(grasps.object_ids).tolist():
        if (np.diff(grasps.scores[grasps.object_ids == k]) > 0).any():
            return [f"the grasps of object {k} are not sorted: the best of each object come first"]
    return []
