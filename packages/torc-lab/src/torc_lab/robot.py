"""Implement the `Robot` of torc.robots.protocols on real devices."""

from dataclasses import replace

from torc import PickOutcome
from torc.records import Capture, PickPlan, as_capture
from torc.robots.description import RobotDescription
from torc.robots.execution import ExecutionConfig, execute_pick
from torc.robots.protocols import Arm, Camera, Gripper, HeldCheck
from torc_lab.protocols import LabError


class LabRobot:
    """A camera, an arm and a gripper. The outcome of a pick is what the gripper felt and what the camera saw in the
    hand: the truth is not known here.
    """

    def __init__(
        self,
        description: RobotDescription,
        camera: Camera,
        arm: Arm,
        gripper: Gripper,
        *,
        config: ExecutionConfig | None = None,
    ) -> None:
        self.description, self.camera, self.arm, self.gripper = description, camera, arm, gripper
        self.config = config or ExecutionConfig()
        self._last_stamp_s = 0.0

    def capture(self) -> Capture:
        """Return one snapshot, with the joint positions now. Raises CameraError, and LabError, also if the camera
        repeats a picture.
        """
        capture = as_capture(self.camera.capture())
        seen = capture.observation
        if seen.stamp_s != 0 and seen.stamp_s == self._last_stamp_s:
            raise LabError("The camera is frozen: it gave the same picture twice.")
        self._last_stamp_s = seen.stamp_s
        return replace(capture, observation=replace(seen, qpos=self.arm.qpos))

    def execute(self, plan: PickPlan, is_target: HeldCheck | None = None) -> PickOutcome:
        """Carry out one pick. If it raises LabError, the pick has no result."""
        ask = (
            None
            if is_target is None
            else lambda: is_target(self.capture().observation, self.gripper.state.width_m)
        )
        trace = execute_pick(self.arm, self.gripper, plan, self.config, is_target=ask)
        return PickOutcome(
            result=trace.result,
            object_id=plan.object_id,
            held_id=plan.object_id if trace.held_after_lift else None,
            held_after_lift=trace.held_after_lift,
            delivered=trace.delivered,
            detail=trace.detail,
            duration_s=sum(p.trajectory.duration_s for p in trace.phases if p.trajectory is not None),
            at_home=trace.at_home,
            touch=trace.touch,
        )
