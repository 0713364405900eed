"""Connect a lab file's devices, build a robot from them, and close them again."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import Any, cast

import numpy as np

from torc.registry.context import BuildContext
from torc.registry.kinds import ARM_DRIVERS, CAMERAS, GRIPPER_DRIVERS
from torc.registry.loading import blamed, make_with
from torc.robots.description import RobotDescription
from torc.robots.execution import ExecutionConfig
from torc.robots.protocols import ContactGuard
from torc_lab.cameras.kinds import open_camera
from torc_lab.checks import MotionLimits, limits_of
from torc_lab.identity import check_standing
from torc_lab.lab_file import Lab, driver_config
from torc_lab.protocols import (
    ArmDriver,
    ArmStatus,
    GripperDriver,
    LabError,
    NeedsActivation,
    PowersServos,
    missing_methods,
)
from torc_lab.robot import LabRobot
from torc_lab.supervisor import Confirm, SupervisedArm, SupervisorConfig

_MEND_DRIVER = "Mend the driver; `torc_lab.testing.arm_conformance` checks it."
_CARRYING_N = 60.0
"""Contact force that stops an arm that carries something; it includes the weight of its load, about a kilogram."""


def connect_arm(lab: Lab) -> ArmDriver:
    """Return the arm's driver, connected; nothing moves.

    Raises:
        LabError: it cannot be reached, its driver lacks a method, it is not the modelled arm, or its torso is turned.
        InputError: a setting of the driver is invalid.
    """
    arm = lab.robot.arm
    context = BuildContext(dof=arm.dof, joint_names=tuple(arm.joint_names))
    options = driver_config(ARM_DRIVERS, lab.arm, f"{lab.path}: arm")
    driver: ArmDriver = make_with(ARM_DRIVERS, lab.arm.driver, options, context)
    _check_whole("arm driver", lab.arm.driver, driver, ArmDriver)
    try:
        with blamed(f"Arm driver '{lab.arm.driver}'", LabError, _MEND_DRIVER):
            if not isinstance(status := driver.status(), ArmStatus):
                raise LabError(
                    f"Arm driver '{lab.arm.driver}': status() returned a {type(status).__name__}; it must be a "
                    "torc_lab.protocols.ArmStatus."
                )
            if (found := len(status.qpos)) != arm.dof:
                raise LabError(f"{driver.name} has {found} joints; the robot {lab.robot.name} has {arm.dof}.")
            check_standing(arm, driver, lab.held_joints)
    except LabError:
        close_arm(driver)
        raise
    return driver


def connect_gripper(lab: Lab) -> GripperDriver:
    """The gripper's driver; nothing moves. Raises LabError, also for a driver that lacks a method, and InputError."""
    options = driver_config(GRIPPER_DRIVERS, lab.gripper, f"{lab.path}: gripper")
    gripper: GripperDriver = make_with(GRIPPER_DRIVERS, lab.gripper.driver, options)
    _check_whole("gripper driver", lab.gripper.driver, gripper, GripperDriver)
    return gripper


def _check_whole(what: str, name: str, device: object, protocol: type) -> None:
    """Raise LabError naming the methods that a driver lacks.

    It is then not even asked to end its connection: its `close` may close the fingers.
    """
    if missing := missing_methods(device, protocol):
        raise LabError(
            f"The {what} '{name}' lacks {', '.join(missing)}: see torc_lab.protocols.{protocol.__name__}."
        )


def limits(lab: Lab) -> MotionLimits:
    """Return the limits of the arm's motion. Motions are planned with the whole margin, and checked with half of it."""
    s = lab.safety
    return limits_of(lab.robot, s.box_lower, s.box_upper, s.speed, 0.5 * s.margin_rad, s.tcp_speed_m_s)


def planned_for(lab: Lab) -> RobotDescription:
    """Return the robot for motion planning, with joint limits reduced by the margin."""
    arm, margin = lab.robot.arm, lab.safety.margin_rad
    return replace(lab.robot, arm=replace(arm, lower=arm.lower + margin, upper=arm.upper - margin))


def execution(lab: Lab, driver: ArmDriver) -> ExecutionConfig:
    """Return how picks are executed: every motion is guarded if the driver feels contact, else none is."""
    config = ExecutionConfig(grip_force_n=lab.safety.grip_force_n, bend_rad=SupervisorConfig().bend_rad)
    if not driver.feels_contact:
        return replace(config, free_guard=None, approach_guard=None)
    return replace(config, carry_guard=ContactGuard(_CARRYING_N), retreat_guard=ContactGuard())


@contextmanager
def opened_lab(lab: Lab, confirm: Confirm) -> Iterator[LabRobot]:
    """Connect everything in a lab file and yield its robot; nothing has moved.

    At the end a moving arm is stopped and all connections are closed; the gripper keeps its grip. Raises LabError,
    InputError, MissingDependencyError.
    """
    with ExitStack() as stack:
        driver = connect_arm(lab)
        stack.callback(stop_and_close, driver)
        if (why := driver.status().stopped) and isinstance(driver, PowersServos):
            raise LabError(
                f"{driver.name} does not move: {why}. If nothing is wrong, `torc lab check --move` powers it."
            )
        gripper = connect_gripper(lab)
        stack.callback(close_gripper, gripper)
        if abs(gripper.max_width_m - lab.robot.gripper.max_width_m) > 0.002:
            raise LabError(
                f"The gripper opens {gripper.max_width_m * 1e3:.0f} mm by its driver, and "
                f"{lab.robot.gripper.max_width_m * 1e3:.0f} mm in the robot description {lab.robot.name}."
            )
        if not is_ready(gripper):
            raise LabError(
                "The gripper was not activated since it got power; that moves its fingers all the way. "
                "`torc lab check --move` does it."
            )
        camera = open_camera(lab.conditions)
        stack.callback(close_camera, camera)
        arm = SupervisedArm(driver, lab.robot, limits(lab), confirm=confirm)
        yield LabRobot(lab.robot, camera, arm, gripper, config=execution(lab, driver))


def is_ready(gripper: GripperDriver) -> bool:
    """Return whether a gripper may be moved; one that needs no activation always may. Raises LabError."""
    return bool(missing_methods(gripper, NeedsActivation)) or cast(NeedsActivation, gripper).ready


def close_arm(driver: ArmDriver) -> None:
    """End the connection to an arm."""
    with suppress(Exception):  # a stranger's driver may fail in any way, and nothing depends on it any more
        driver.close()


def close_gripper(gripper: GripperDriver) -> None:
    """End the connection to a gripper; its `close` would close the fingers."""
    with suppress(Exception):
        gripper.disconnect()


def close_camera(camera: Any) -> None:
    """End the connection to a camera, if it has one."""
    with suppress(Exception):
        CAMERAS.traits(camera).close()


def stop_and_close(driver: ArmDriver) -> None:
    """Stop an arm that still moves, and end the connection."""
    with suppress(Exception):
        if driver.status().moving:
            driver.stop()
    close_arm(driver)


def is_at_rest_pose(lab: Lab, qpos: np.ndarray, within_rad: float = 0.1) -> bool:
    """Return whether the arm is at the description's rest pose, where it does not hide the table from the camera."""
    return bool(np.abs(qpos - lab.robot.arm.rest_qpos).max() <= within_rad)
