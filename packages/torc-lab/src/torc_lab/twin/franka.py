"""A simulated Franka hand: the actions and the topic of franka_gripper, for a `RosTwin` to offer.

It moves any `Fingers` of `torc_lab.twin.base`.
"""

import time
from collections.abc import Mapping
from typing import Any

from torc_lab.robotiq.gripper import FORCE_N, WidthScale
from torc_lab.robotiq.registers import Object
from torc_lab.ros.messages import SUCCEEDED
from torc_lab.twin.base import Fingers

_ABORTED = 6
_MOTION_S, _BEGINS_S, _POLL_S = 8.0, 0.1, 0.01


class FrankaHandTwin:
    """Imitates the node franka_gripper.

    Attributes:
        name: the node's name.
        fault: if it is not 0, every action fails.
    """

    def __init__(self, fingers: Fingers, max_width_m: float, name: str = "/franka_gripper") -> None:
        self.fingers, self.name, self.fault = fingers, name, 0
        self._scale = WidthScale(max_width_m=max_width_m)

    def joint_states(self) -> dict[str, Any]:
        """Return a JointState message; each finger's position is half of the opening."""
        width_m = self._scale.width_m(self.fingers.now()[0])
        return {"name": ["finger_joint1", "finger_joint2"], "position": [width_m / 2, width_m / 2]}

    def act(self, action: str, goal: Mapping[str, Any]) -> tuple[int, dict[str, Any]]:
        """Carry out move, grasp or homing; return the action's status and the values of its result."""
        if self.fault:
            return _ABORTED, {"success": False, "error": "libfranka gripper: command failed"}
        closing = action == "grasp"
        if closing:
            share = (float(goal["force"]) - FORCE_N[0]) / (FORCE_N[1] - FORCE_N[0])
            self._go(255, round(255 * min(1.0, max(0.0, share))))
            width_m = self._scale.width_m(self.fingers.now()[0])
            epsilon, wanted = goal["epsilon"], float(goal["width"])
            good = wanted - epsilon["inner"] < width_m < wanted + epsilon["outer"]
        else:
            if action == "homing":
                self._go(255, 0)
            width_m = float(goal.get("width", self._scale.max_width_m))
            good = self._go(self._scale.count(width_m), 0) is Object.AT_POSITION
        return SUCCEEDED[2], {"success": bool(good), "error": ""}

    def _go(self, position: int, force: int) -> Object:
        """Move the fingers to a position and wait until they rest."""
        self.fingers.go(position, 255, force)
        time.sleep(_BEGINS_S)
        deadline = time.monotonic() + _MOTION_S
        while (found := self.fingers.now()[1]) is Object.MOVING and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        return found
