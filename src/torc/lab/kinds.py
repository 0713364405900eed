"""The kinds of drivers, under the name that they had before."""

from torc.registry.kinds import ARM_DRIVERS as ARM_DRIVERS
from torc.registry.kinds import GRIPPER_DRIVERS as GRIPPER_DRIVERS
