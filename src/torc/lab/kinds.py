"""Drivers of arms and grippers by name: what comes with torc, and how others register theirs. Light to import."""

from torc.plugins import PartKind

ARM_DRIVERS = PartKind(
    "arm driver",
    "torc.arm_drivers",
    "start(trajectory)",
    {
        "ros": "torc.lab.ros.arm:RosArm",
        "motoman": "torc.lab.simple_message.arm:MotomanArm",
        "ur-rtde": "torc.lab.ur.arm:UrArm",
    },
)
GRIPPER_DRIVERS = PartKind(
    "gripper driver",
    "torc.gripper_drivers",
    "close(force_n)",
    {
        "robotiq-modbus": "torc.lab.robotiq.gripper:over_modbus",
        "robotiq-urcap": "torc.lab.robotiq.gripper:over_urcap",
        "franka-hand": "torc.lab.ros.franka_hand:FrankaHand",
    },
)
