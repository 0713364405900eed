"""Straight lines by the differential inverse kinematics of pink (paper: Motion Planning), with daqp as its
solver.

pink returns no error where a line leaves the arm's reach or meets a limit: the caller checks what comes back.
"""

import numpy as np
from jaxtyping import Float

from torc.errors import MissingDependencyError
from torc.robots.description import ArmDescription

try:
    import pink
    import pinocchio as pin
    from pink.tasks import FrameTask, PostureTask
except ImportError as error:
    # pinocchio's wheel leaves this one library to the system.
    raise MissingDependencyError(f"pinocchio ({error})", "apt-get install libgomp1") from error

_FRAME = "tool0"


class PinkFollower:
    """Follows poses of the flange with one arm."""

    def __init__(self, arm: ArmDescription, limit_margin_rad: float, steps: int = 2) -> None:
        """steps: solver calls per pose."""
        self._model = _pinocchio_model(arm, limit_margin_rad)
        self._steps = steps

    def follow(
        self,
        start: Float[np.ndarray, "dof"],
        Ts_world_tool0: Float[np.ndarray, "m 4 4"],
        posture: Float[np.ndarray, "m dof"],
        dt_s: float,
    ) -> Float[np.ndarray, "m dof"] | None:
        """A configuration per pose, drawn a little to the given posture; None if the solver finds no step.

        dt_s: time from pose to pose, for the joints' speed limits.
        """
        configuration = pink.Configuration(
            self._model, self._model.createData(), np.array(start, dtype=float)
        )
        line = FrameTask(_FRAME, position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
        stay = PostureTask(cost=1e-4)
        path = np.empty((len(Ts_world_tool0), len(start)))
        for k, T in enumerate(Ts_world_tool0):
            line.set_target(pin.SE3(T[:3, :3], T[:3, 3]))
            stay.set_target(posture[k])
            for _ in range(self._steps):
                try:
                    velocity = pink.solve_ik(
                        configuration, [line, stay], dt_s / self._steps, solver="daqp", safety_break=False
                    )
                except pink.exceptions.PinkError:
                    return None
                configuration.integrate_inplace(velocity, dt_s / self._steps)
            path[k] = configuration.q
        return path


def _pinocchio_model(arm: ArmDescription, limit_margin_rad: float) -> "pin.Model":
    """The arm's kinematics; it has no masses."""
    model = pin.Model()
    parent, T = 0, arm.T_world_base @ arm.Ts_parent_joint[0]
    for i, name in enumerate(arm.joint_names):
        if i > 0:
            T = arm.Ts_parent_joint[i]
        joint = pin.JointModelRevoluteUnaligned(np.asarray(arm.axes[i], dtype=float))
        parent = model.addJoint(
            parent,
            joint,
            pin.SE3(T[:3, :3], T[:3, 3]),
            name,
            np.array([1e3]),
            arm.max_speed[i : i + 1],
            arm.lower[i : i + 1] + limit_margin_rad,
            arm.upper[i : i + 1] - limit_margin_rad,
        )
    T = arm.T_last_tool0
    model.addFrame(pin.Frame(_FRAME, parent, 0, pin.SE3(T[:3, :3], T[:3, 3]), pin.FrameType.OP_FRAME))
    return model
