"""Drivers of arms and grippers by name: what comes with torc, and how others register theirs. Light to import."""

from torc.plugins import PartKind

ARM_DRIVERS = PartKind(
    "arm driver",
    "torc.arm_drivers",
    "start(trajectory)",
    {
        "ros": "torc_lab.ros.arm:RosArm",
        "motoman": "torc_lab.simple_message.arm:MotomanArm",
        "ur-rtde": "torc_lab.ur.arm:UrArm",
    },
)
GRIPPER_DRIVERS = PartKind(
    "gripper driver",
    "torc.gripper_drivers",
    "close(force_n)",
    {
        "robotiq-modbus": "torc_lab.robotiq.gripper:over_modbus",
        "robotiq-urcap": "torc_lab.robotiq.gripper:over_urcap",
        "franka-hand": "torc_lab.ros.franka_hand:FrankaHand",
    },
)
