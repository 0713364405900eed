"""The arguments that parts may receive when they are made."""

from __future__ import annotations

import inspect
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # Types only, so that this module stays light and at the bottom of the packages.
    from collections.abc import Callable

    from torc.robots.description import RobotDescription
    from torc.robots.gripper import GripperDescription
    from torc.robots.protocols import Camera
    from torc.vlm.config import Asking, VlmConfig
    from torc.vlm.protocol import VlmClient
    from torc.vlm.simulated.situation import Situation
    from torc.workspace.description import Workspace


@dataclass(frozen=True)
class BuildContext:
    """What a part may receive when it is made, besides its settings.

    The one rule: a parameter of a part's `__init__` that has the name of a field below receives that field, unless the
    field is None. All other parameters are settings.

    Attributes:
        workspace: table, bin and camera pose.
        robot: kinematics and shape of the arm and its gripper.
        gripper: the gripper alone.
        support_z_m: height of the table top in the world, metres.
        camera: the simulated camera, for a camera that looks through it.
        client: the VLM that a task planner asks.
        asking: pictures, prompt and version of the questions, for a planner that asks one.
        config: the model and its options, for a VLM client.
        truth: returns the true situation in the simulation now, for the simulated VLM.
        dof: number of joints, for an arm driver.
        joint_names: the joints' names in the robot description, for an arm driver.
    """

    workspace: Workspace | None = None
    robot: RobotDescription | None = None
    gripper: GripperDescription | None = None
    support_z_m: float | None = None
    camera: Camera | None = None
    client: VlmClient | None = None
    asking: Asking | None = None
    config: VlmConfig | None = None
    truth: Callable[[], Situation] | None = None
    dof: int | None = None
    joint_names: tuple[str, ...] | None = None

    def given_to(self, factory: Any) -> dict[str, Any]:
        """Return those of these arguments that a class, or a function that makes a part, takes."""
        names = GIVEN & parameters(factory)
        return {name: value for name in names if (value := getattr(self, name)) is not None}


GIVEN = frozenset(field.name for field in fields(BuildContext))
"""The names of parameters that are not settings."""


_ANYTHING = inspect.Signature([inspect.Parameter("options", inspect.Parameter.VAR_KEYWORD)])


def signature_of(factory: Any) -> inspect.Signature:
    """Return the signature of a class or function; one that takes anything if it has none, like compiled ones."""
    try:
        return inspect.signature(factory)
    except (TypeError, ValueError):
        return _ANYTHING


def parameters(factory: Any) -> frozenset[str]:
    """Return the names of the arguments that something takes, as far as they are known."""
    return frozenset(signature_of(factory).parameters)
