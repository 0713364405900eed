"""A lab file's devices, connected: a robot of them, and all that is closed again."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import Any

import numpy as np

from torc.cameras.kinds import open_camera
from torc.errors import TorcError
from torc.lab.checks import MotionLimits, limits_of
from torc.lab.kinds import ARM_DRIVERS, GRIPPER_DRIVERS
from torc.lab.lab_file import Lab, driver_config
from torc.lab.protocols import ArmDriver, LabError
from torc.lab.robot import LabRobot
from torc.lab.supervisor import Confirm, SupervisedArm
from torc.plugins import make_part
from torc.robots.description import RobotDescription
from torc.robots.execution import ExecutionConfig
from torc.robots.protocols import Gripper


def connect_arm(lab: Lab) -> ArmDriver:
    """The arm's driver. Raises LabError, InputError."""
    arm = lab.robot.arm
    offered = {"dof": arm.dof, "joint_names": tuple(arm.joint_names)}
    options = driver_config(ARM_DRIVERS, lab.arm, f"{lab.path}: arm")
    driver: ArmDriver = make_part(ARM_DRIVERS, lab.arm.driver, options, offered)
    if (found := len(driver.status().qpos)) != arm.dof:
        driver.close()
        raise LabError(f"{driver.name} has {found} joints; the robot {lab.robot.name} has {arm.dof}.")
    return driver


def connect_gripper(lab: Lab) -> Gripper:
    """The gripper. Raises LabError, InputError."""
    options = driver_config(GRIPPER_DRIVERS, lab.gripper, f"{lab.path}: gripper")
    gripper: Gripper = make_part(GRIPPER_DRIVERS, lab.gripper.driver, options)
    return gripper


def limits(lab: Lab) -> MotionLimits:
    """Within what the arm may move. Motions are planned with the whole margin, and checked with half of it."""
    s = lab.safety
    return limits_of(lab.robot, s.box_lower, s.box_upper, s.speed, 0.5 * s.margin_rad)


def planned_for(lab: Lab) -> RobotDescription:
    """The robot as motions are planned for it: it keeps the margin from its joint limits."""
    arm, margin = lab.robot.arm, lab.safety.margin_rad
    return replace(lab.robot, arm=replace(arm, lower=arm.lower + margin, upper=arm.upper - margin))


def execution(lab: Lab, driver: ArmDriver) -> ExecutionConfig:
    """How picks are carried out: without guards where no contact is felt."""
    config = ExecutionConfig(grip_force_n=lab.safety.grip_force_n)
    return config if driver.feels_contact else replace(config, free_guard=None, approach_guard=None)


@contextmanager
def opened_lab(lab: Lab, confirm: Confirm) -> Iterator[LabRobot]:
    """The robot of a lab file, everything connected; nothing has moved. At the end the arm is stopped, if it moves, and
    all connections are closed; the gripper keeps its grip. Raises LabError, InputError, MissingDependencyError.
    """
    with ExitStack() as stack:
        driver = connect_arm(lab)
        stack.callback(stop_and_close, driver)
        if (why := driver.status().stopped) and hasattr(driver, "enable"):
            raise LabError(
                f"{driver.name} does not move: {why}. If nothing is wrong, `torc lab check --move` powers it."
            )
        gripper = connect_gripper(lab)
        stack.callback(close_device, gripper)
        if abs(gripper.max_width_m - lab.robot.gripper.max_width_m) > 0.002:
            raise LabError(
                f"The gripper opens {gripper.max_width_m * 1e3:.0f} mm by its driver, and "
                f"{lab.robot.gripper.max_width_m * 1e3:.0f} mm in the robot description {lab.robot.name}."
            )
        if getattr(gripper, "ready", True) is False:
            raise LabError(
                "The gripper was not activated since it got power; that moves its fingers all the way. "
                "`torc lab check --move` does it."
            )
        camera = open_camera(lab.conditions)
        stack.callback(close_device, camera)
        arm = SupervisedArm(driver, lab.robot, limits(lab), confirm=confirm)
        yield LabRobot(lab.robot, camera, arm, gripper, config=execution(lab, driver))


def close_device(device: Any) -> None:
    """Ends a connection, whatever it is of."""
    for name in ("disconnect", "close"):
        if callable(method := getattr(device, name, None)):
            with suppress(TorcError, OSError):
                method()
            return


def stop_and_close(driver: ArmDriver) -> None:
    """Stops an arm that still moves, and ends the connection."""
    with suppress(TorcError, OSError):
        if driver.status().moving:
            driver.stop()
    with suppress(TorcError, OSError):
        driver.close()


def is_at_rest_pose(lab: Lab, qpos: np.ndarray, within_rad: float = 0.1) -> bool:
    """Whether the arm is where it does not hide the table from the camera, by the robot description."""
    return bool(np.abs(qpos - lab.robot.arm.rest_qpos).max() <= within_rad)
