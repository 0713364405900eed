"""Check that the arm behind a driver is the one that the robot description models, with fixed joints in place."""

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from torc import InputError
from torc.robots.description import ArmDescription
from torc_lab.protocols import ArmDriver, LabError, SeesOtherJoints

_HEARD_S = 0.5
_HELD_WITHIN_RAD = 0.01
"""Greatest error of a held joint: a centimetre at arm's length."""


@dataclass(frozen=True)
class Hardware:
    """What torc knows about an arm beyond its model.

    Attributes:
        group: its number on a Motoman controller.
        held: positions of joints that the model assumes fixed, radians, by name in ROS or as "group N" on a Motoman
            controller.
        others: parts of ROS action names that belong to other arms of the same robot, and which arm that is.
    """

    group: int | None = None
    held: Mapping[str, float] = field(default_factory=dict)
    others: Mapping[str, str] = field(default_factory=dict)


# motoman_sda10f_support 1.9.12, config/sda10f_motion_interface.yaml.
_SDA10F = Hardware(1, {"torso_joint_b1": 0.0, "group 2": 0.0}, {"sda10f_r1_controller": "the left arm"})


def hardware_of(arm: ArmDescription) -> Hardware:
    """Return what torc knows about a modelled arm; empty for most."""
    return _SDA10F if arm.joint_names[0] == "arm_right_joint_1_s" else Hardware()


def check_settings(arm: ArmDescription, settings: Mapping[str, Any], where: str) -> None:
    """Raise InputError if a driver's settings name a different arm than the modelled one."""
    known = hardware_of(arm)
    group = settings.get("group")
    if known.group is not None and group is not None and group != known.group:
        raise InputError(f"{where}: group {group} is another arm; the modelled one is group {known.group}.")
    action = str(settings.get("action", ""))
    for part, which in known.others.items():
        if part in action:
            raise InputError(
                f"{where}: the action {action} is that of {which}, which is not the modelled one."
            )
    if names := settings.get("joint_names"):
        check_names(arm.joint_names, names, where)


def check_names(modelled: Sequence[str], named: Sequence[str], where: str) -> None:
    """Raise InputError if joint names do not match the model's one by one, in side, number and order. A prefix may
    differ.
    """
    if len(named) != len(modelled):
        raise InputError(
            f"{where}: joint_names has {len(named)} entries; the arm has {len(modelled)} joints."
        )
    for own, given in zip(modelled, named, strict=True):
        if not _alike(own, given):
            raise InputError(f"{where}: the joint {given} is not the modelled {own}. Is it another arm?")


def check_standing(arm: ArmDescription, driver: ArmDriver, held: Mapping[str, float]) -> list[str]:
    """Return held joints that the driver does not report within half a second. Raises LabError if one is not where
    the model has it.

    Args:
        arm: the modelled arm.
        driver: connected to it.
        held: held joints of the lab file, radians, in addition to those that torc knows of the arm.
    """
    known = hardware_of(arm).held
    # A known joint has a name in each protocol: one of them is enough. What the user named must be there.
    wanted = [{name} for name in held] + ([set(known)] if known else [])
    if not wanted:
        return []
    reported: Mapping[str, float] = {}
    deadline = time.monotonic() + _HEARD_S
    while not all(names & reported.keys() for names in wanted) and time.monotonic() < deadline:
        reported = driver.other_joints() if isinstance(driver, SeesOtherJoints) else {}
        time.sleep(0.01)
    for name, position in {**known, **held}.items():
        if name in reported and abs(reported[name] - position) > _HELD_WITHIN_RAD:
            raise LabError(
                f"{name} is at {reported[name]:.3f} rad; the robot description has it at {position:.3f}, so the arm "
                "would go elsewhere. Bring it there by the pendant."
            )
    return [" or ".join(sorted(names)) for names in wanted if not names & reported.keys()]


def _alike(modelled: str, named: str) -> bool:
    if _side(modelled) and _side(named) and _side(modelled) != _side(named):
        return False
    numbers = [re.findall(r"\d+", name)[-1:] for name in (modelled, named)]
    if all(numbers):
        return numbers[0] == numbers[1]
    return named.endswith(modelled)


def _side(name: str) -> str:
    words = re.split(r"[^a-z]+", name.lower())
    return next((side for side in ("left", "right") if side in words), "")
