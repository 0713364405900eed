"""A whole laboratory that is none: the simulator behind the wires that a lab file names, on the loopback interface."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
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
"""A controller refuses what is so many times faster than torc ever moves the robot: the maker allows more."""


@dataclass(frozen=True)
class Rehearsal:
    """The twins of a lab file.

    Attributes:
        world: behind them.
        arm: twin of the arm's controller, whose faults come on command.
        gripper: twin of the gripper.
        pictures: where the camera's pictures come from.
        text: a lab file like the user's, but with the twins' addresses.
    """

    world: LiveWorld
    arm: RosTwin | MotomanTwin | UrTwin
    gripper: RobotiqTwin | FrankaHandTwin
    pictures: RosTwin
    text: str


@contextmanager
def rehearsal(lab: Lab, problem: Problem) -> Iterator[Rehearsal]:
    """Twins of a lab's devices around a problem, during a `with`. Raises InputError for drivers without a twin."""
    with ExitStack() as stack:
        world = stack.enter_context(LiveWorld(problem, lab.robot, lab.workspace))
        gripper = _gripper(lab, world)
        arm, pictures, arm_settings = _arm(lab, world, gripper, stack)
        gripper_settings = _offered(lab, gripper, pictures, stack)
        camera = {"driver": "ros", "url": pictures.url, "pose": "workspace"}
        content = yaml.safe_load(read_text(lab.path))
        content |= {
            "name": f"{lab.name}-twin",
            "robot": lab.conditions.robot,
            "workspace": lab.conditions.workspace,
            "arm": {**content["arm"], **arm_settings},
            "gripper": {**content["gripper"], **gripper_settings},
            "camera": camera,
        }
        yield Rehearsal(world, arm, gripper, pictures, yaml.safe_dump(content, sort_keys=False))


def write_lab(text: str, path: Path) -> None:
    """Writes a rehearsal's lab file. Raises InputError where that cannot be."""
    try:
        path.write_text(
            "# The twins of a laboratory: for rehearsals while they run.\n" + text, encoding="utf-8"
        )
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}. Choose another --out.") from error


def _arm(
    lab: Lab, world: LiveWorld, gripper: RobotiqTwin | FrankaHandTwin, stack: ExitStack
) -> tuple[RosTwin | MotomanTwin | UrTwin, RosTwin, dict[str, Any]]:
    """The controller's twin, who gives the camera's pictures, and the settings of the arm that lead there."""
    settings, joints = lab.arm.settings, lab.robot.arm
    hand = gripper if isinstance(gripper, FrankaHandTwin) else None
    if lab.arm.driver == "ros":
        names = settings.get("joint_names") or joints.joint_names
        arm = stack.enter_context(RosTwin(world, names, settings["ros"], settings["action"], 0, world, hand))
        arm.others |= {**hardware_of(joints).held, **lab.held_joints}
        return arm, arm, {"url": arm.url}
    if lab.arm.driver == "motoman":
        fastest = _CONTROLLER_SPEED * joints.max_speed
        motoman = stack.enter_context(MotomanTwin(world, fastest, int(settings["group"])))
        # Its pictures come by a bridge of their own.
        pictures = stack.enter_context(RosTwin(world, joints.joint_names, camera=world, hand=hand))
        motion_port, state_port = motoman.ports
        return (
            motoman,
            pictures,
            {
                "host": "127.0.0.1",
                "motion_port": motion_port,
                "state_port": state_port,
            },
        )
    if lab.arm.driver == "ur-rtde":
        ur = stack.enter_context(UrTwin(world))
        pictures = stack.enter_context(RosTwin(world, joints.joint_names, camera=world))
        return ur, pictures, {"host": ur.host}
    raise InputError(
        f"There is no twin of the arm driver '{lab.arm.driver}'; there are of ros, motoman and ur-rtde."
    )


def _gripper(lab: Lab, world: LiveWorld) -> RobotiqTwin | FrankaHandTwin:
    """The gripper's twin."""
    if lab.gripper.driver == "franka-hand":
        settings = lab.gripper.settings
        return FrankaHandTwin(world, lab.robot.gripper.max_width_m, settings.get("name", "/franka_gripper"))
    return RobotiqTwin(world)


def _offered(
    lab: Lab, twin: RobotiqTwin | FrankaHandTwin, bridge: RosTwin, stack: ExitStack
) -> dict[str, Any]:
    """The settings of the gripper that lead to its twin."""
    if isinstance(twin, FrankaHandTwin):
        return {"url": bridge.url}
    if lab.gripper.driver == "robotiq-modbus":
        return {"address": stack.enter_context(ModbusTwin(twin)).address}
    if lab.gripper.driver == "robotiq-urcap":
        return {"address": stack.enter_context(UrcapTwin(twin)).address}
    raise InputError(
        f"There is no twin of the gripper driver '{lab.gripper.driver}'; there are of robotiq-modbus, robotiq-urcap "
        "and franka-hand."
    )
