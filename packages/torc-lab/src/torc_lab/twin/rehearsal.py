"""Twins of the devices of a lab file, around a simulated world, with faults on command."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from torc import InputError, Problem
from torc.io.reading import read_text
from torc_lab.identity import hardware_of
from torc_lab.lab_file import Lab
from torc_lab.twin.franka import FrankaHandTwin
from torc_lab.twin.motoman import MotomanTwin
from torc_lab.twin.robotiq import ModbusTwin, RobotiqTwin, UrcapTwin
from torc_lab.twin.ros import RosTwin
from torc_lab.twin.ur import UrTwin
from torc_lab.twin.world import LiveWorld

_CONTROLLER_SPEED = 2.0
"""A controller refuses motions faster than torc's speed limits times this: the maker allows more than torc does."""
_NUDGE_RAD = 0.05
_MOTOR_FAULT = 0x0E
ArmTwin = RosTwin | MotomanTwin | UrTwin
GripperTwin = RobotiqTwin | FrankaHandTwin


@dataclass(frozen=True)
class Rehearsal:
    """The twins of a lab file.

    Attributes:
        world: the simulated world that the twins share.
        arm: twin of the arm's controller; faults are triggered on command.
        gripper: twin of the gripper.
        pictures: the twin that publishes the camera's pictures.
        text: a lab file like the user's, but with the twins' addresses.
    """

    world: LiveWorld
    arm: ArmTwin
    gripper: GripperTwin
    pictures: RosTwin
    text: str


@contextmanager
def rehearsal(lab: Lab, problem: Problem) -> Iterator[Rehearsal]:
    """Run twins of a lab's devices around a problem, during a `with`. Raises InputError for drivers without a twin."""
    with ExitStack() as stack:
        world = stack.enter_context(LiveWorld(problem, lab.robot, lab.workspace))
        gripper, gripper_settings = _gripper(lab, world, stack)
        arm, bridge, arm_settings = _arm(lab, world, gripper, stack)
        content = yaml.safe_load(read_text(lab.path))
        content |= {
            "name": f"{lab.name}-twin",
            "robot": lab.conditions.robot,
            "workspace": lab.conditions.workspace,
            "arm": {**content["arm"], **arm_settings},
            "gripper": {**content["gripper"], **(gripper_settings or {"url": bridge.url})},
            "camera": {"driver": "ros", "url": bridge.url, "pose": "workspace"},
        }
        yield Rehearsal(world, arm, gripper, bridge, yaml.safe_dump(content, sort_keys=False))


def write_lab(text: str, path: Path) -> None:
    """Write a rehearsal's lab file. Raises InputError if it cannot be written."""
    try:
        path.write_text(
            "# The twins of a laboratory: for rehearsals while they run.\n" + text, encoding="utf-8"
        )
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}. Choose another --out.") from error


def _gripper(lab: Lab, world: LiveWorld, stack: ExitStack) -> tuple[GripperTwin, dict[str, Any]]:
    """Return the gripper's twin and the settings to reach it; no settings if it is behind the bridge."""
    robotiq = RobotiqTwin(world)
    match lab.gripper.driver:
        case "robotiq-modbus":
            return robotiq, {"address": stack.enter_context(ModbusTwin(robotiq)).address}
        case "robotiq-urcap":
            return robotiq, {"address": stack.enter_context(UrcapTwin(robotiq)).address}
        case "franka-hand":
            name = lab.gripper.settings.get("name", "/franka_gripper")
            return FrankaHandTwin(world, lab.robot.gripper.max_width_m, name), {}
    raise InputError(
        f"There is no twin of the gripper driver '{lab.gripper.driver}'; there are of robotiq-modbus, robotiq-urcap "
        "and franka-hand."
    )


def _arm(
    lab: Lab, world: LiveWorld, gripper: GripperTwin, stack: ExitStack
) -> tuple[ArmTwin, RosTwin, dict[str, Any]]:
    """Return the controller's twin, the bridge with the camera's pictures, and the settings to reach the arm."""
    settings, joints = lab.arm.settings, lab.robot.arm
    hand = gripper if isinstance(gripper, FrankaHandTwin) else None
    arm: ArmTwin
    match lab.arm.driver:
        case "ros":
            names = settings.get("joint_names") or joints.joint_names
            arm = bridge = RosTwin(world, names, settings["ros"], settings["action"], world, hand)
            arm.others |= {**hardware_of(joints).held, **lab.held_joints}
            return stack.enter_context(arm), bridge, {"url": arm.url}
        case "motoman":
            arm = MotomanTwin(world, _CONTROLLER_SPEED * joints.max_speed, int(settings["group"]))
            motion_port, state_port = arm.ports
            leads = {"host": arm.host, "motion_port": motion_port, "state_port": state_port}
        case "ur-rtde":
            arm = UrTwin(world)
            leads = {"host": arm.host}
        case other:
            raise InputError(
                f"There is no twin of the arm driver '{other}'; there are of ros, motoman and ur-rtde."
            )
    stack.enter_context(arm)
    return arm, stack.enter_context(RosTwin(world, joints.joint_names, camera=world, hand=hand)), leads


def _nudge(there: Rehearsal) -> None:
    there.world.goal(there.world.qpos + _NUDGE_RAD)


def _silence(there: Rehearsal) -> None:
    there.arm.silent = True


def _gripper_fault(there: Rehearsal) -> None:
    there.gripper.fault = _MOTOR_FAULT


def _freeze(there: Rehearsal) -> None:
    there.pictures.frozen = True


def recover(there: Rehearsal) -> None:
    """End all faults; connections that were cut stay so."""
    there.arm.recover()
    there.pictures.recover()
    there.gripper.fault = 0


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
"""Name -> (what happens, a function that causes it and returns False if it cannot now)."""
ACTIONS: Mapping[str, tuple[str, Callable[[Rehearsal], object]]] = MappingProxyType(
    {
        "recover": ("all is well again, but for connections that were cut", recover),
        "reset": ("somebody lays the scene out again", lambda there: there.world.reset()),
        "disturb": ("somebody pushes an object aside by 3 cm", lambda there: there.world.disturb()),
    }
)
"""A person's actions: name -> (description, function)."""
