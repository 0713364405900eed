"""What goes wrong in laboratories, on command."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from torc_lab.twin.motoman import READY as MOTOMAN_READY
from torc_lab.twin.motoman import MotomanTwin
from torc_lab.twin.rehearsal import Rehearsal
from torc_lab.twin.ros import READY as ROS_READY
from torc_lab.twin.ur import READY as UR_READY
from torc_lab.twin.ur import UrTwin

_NUDGE_RAD = 0.05


def _nudge(there: Rehearsal) -> None:
    there.world.goal(there.world.qpos + _NUDGE_RAD)


def _silence(there: Rehearsal) -> None:
    there.arm.silent = True


def _gripper_fault(there: Rehearsal) -> None:
    there.gripper.fault = 0x0E


def _freeze(there: Rehearsal) -> None:
    there.pictures.frozen = True


FAULTS: Mapping[str, tuple[str, Callable[[Rehearsal], bool | None]]] = MappingProxyType(
    {
        "e-stop": ("somebody presses it", lambda there: there.arm.halt(e_stopped=1)),
        "protective-stop": ("the controller stops in an error", lambda there: there.arm.halt(in_error=1)),
        "teach": ("somebody turns the key to teach mode", lambda there: there.arm.halt(mode=1)),
        "cut": ("the cable to the arm is pulled", lambda there: there.arm.cut()),
        "silence": ("the arm says nothing any more, and moves on", _silence),
        "pretend-done": (
            "the arm stops halfway, and says that it succeeded",
            lambda there: there.arm.pretend_done(),
        ),
        "nudge": ("somebody pushes the arm aside", _nudge),
        "gripper-fault": ("the gripper's motor reports a fault", _gripper_fault),
        "freeze-camera": ("the camera gives one picture again and again", _freeze),
    }
)
"""Name -> what happens, and what makes it happen, which returns False if it cannot now."""


def recover(there: Rehearsal) -> None:
    """All is well again, but for connections that were cut."""
    there.arm.silent = there.pictures.frozen = False
    there.gripper.fault = 0
    if isinstance(there.arm, MotomanTwin):
        there.arm.state = MOTOMAN_READY
    elif isinstance(there.arm, UrTwin):
        there.arm.state = dict(UR_READY)
    else:
        there.arm.state = dict(ROS_READY)


SCENE: Mapping[str, tuple[str, Callable[[Rehearsal], object]]] = MappingProxyType(
    {
        "reset": ("somebody lays the scene out again", lambda there: there.world.reset()),
        "disturb": ("somebody pushes an object aside by 3 cm", lambda there: there.world.disturb()),
    }
)
"""What a person does on the table: name -> what, and what does it."""
