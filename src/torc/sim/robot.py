"""The simulated robot: looks, carries out picks, and knows their true outcomes."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.records import (
    TARGET_ID,
    Capture,
    FeltOutcome,
    Observation,
    PickOutcome,
    PickPlan,
    PickResult,
    StereoPair,
    as_capture,
)
from torc.robots.description import RobotDescription
from torc.robots.execution import ExecutionConfig, ExecutionTrace, Phase, PhaseTrace, execute_pick
from torc.robots.protocols import Camera, HeldCheck
from torc.sim.actuation import GripState, SimulatedArm, SimulatedGripper
from torc.sim.contacts import ContactReader
from torc.sim.rendering import CameraRenderer, Closing, View
from torc.sim.settling import SettleConfig
from torc.sim.simulated_world import Presence, World, refresh, restore_state, save_state
from torc.sim.stepping import Observer, Stepper, StepperState
from torc.sim.stereo_camera import StereoRig, stereo_pair

_NOISE = 455
"""First number of the stereo camera's seed."""


@dataclass(frozen=True)
class SimulatedRobotConfig:
    """The simulated robot.

    Attributes:
        risen_m: an object that is this much higher after the lift is held, if it touches the gripper.
        backend: how to render, None for the best available.
        rig, pairs: with `pairs` the camera is the left one of the stereo `rig`.
    """

    execution: ExecutionConfig = field(default_factory=ExecutionConfig)
    rest: SettleConfig = field(default_factory=lambda: SettleConfig(limit_s=1.5))
    risen_m: float = 0.02
    backend: str | None = None
    color: bool = True
    rig: StereoRig = field(default_factory=StereoRig)
    pairs: bool = False


@dataclass(frozen=True)
class RobotState:
    """A simulated robot and its world at one moment: everything that decides what happens next."""

    world: Float[np.ndarray, "s"]
    grip: GripState
    stepper: StepperState


class SimulatedRobot(Closing):
    """The `Robot` of torc.robots.protocols in a simulated world.

    Objects that are delivered, or that left the table otherwise, are out of the scene after the pick.
    """

    def __init__(
        self, world: World, config: SimulatedRobotConfig | None = None, observer: Observer | None = None
    ) -> None:
        """Take over a world that was built with a robot; only this robot may step it.

        The observer is called with it about 25 times per simulated second.
        """
        if world.robot is None:
            raise ValueError("The world was built without a robot.")
        self.world, self.config = world, config or SimulatedRobotConfig()
        self.description: RobotDescription = world.robot
        self._stepper = Stepper(world, observer)
        self.gripper = SimulatedGripper(self._stepper, world.robot)
        self.arm = SimulatedArm(self._stepper, world.robot, self.gripper)
        rig = self.config.rig if self.config.pairs else None
        self.camera = SimulatedCamera(world, self.config.backend, self.config.color, rig)
        self._eye: Camera = self.camera
        self._contacts = ContactReader(world, world.robot)
        self._true_id: int | None = None
        self.last_trace: ExecutionTrace | None = None
        """The commands of the latest pick, and what the robot itself felt."""

    def take_over(self) -> tuple[int, ...]:
        """Let the scene come to rest before the first pick, and remove objects that are then not on the table.

        Returns the ids of what was removed, which nobody dropped. Raises InputError if the target is one of them, and
        PhysicsError if the simulation broke.
        """
        self.wait_for_rest()
        absent = self.world.off_table()
        if TARGET_ID in absent:
            raise InputError(
                f"Problem '{self.world.problem.name}': the target falls off the table before the first pick. "
                "Place it so that it lies still."
            )
        for object_id in absent:
            self.world.park(object_id, Presence.ABSENT)
        self.world.update_position_stage()
        return absent

    def capture(self) -> Capture:
        """Return one snapshot, taken now, with its true labels."""
        return as_capture(self._eye.capture())

    def aim_at(self, true_id: int | None) -> None:
        """Note which object the next pick is meant for, if perception numbers objects in its own way."""
        self._true_id = true_id

    def look_through(self, camera: Camera) -> None:
        """Take further snapshots with another camera, which may look through the simulated one."""
        self._eye = camera

    def execute(self, plan: PickPlan, is_target: HeldCheck | None = None) -> PickOutcome:
        """Carry out one pick, and return its outcome by the simulator's truth, with what the gripper felt.

        `is_target` is asked about what was lifted. Raises InputError if the plan does not start where the arm is, and
        PhysicsError if the simulation broke.
        """
        true_id, self._true_id = self._true_id, None
        # Whether the state before a pick was restored or reached must not matter for the pick.
        refresh(self.world)
        start_s = self.world.time_s
        heights_before = self.world.positions[:, 2]
        carried: dict[int, bool] = {}

        def look(step: PhaseTrace) -> None:
            if step.phase is Phase.LIFT and step.reached:
                carried.update(self._contacts.carried(heights_before, self.config.risen_m))

        ask = (
            None
            if is_target is None
            else lambda: is_target(self.capture().observation, self.gripper.state.width_m)
        )
        trace = execute_pick(self.arm, self.gripper, plan, self.config.execution, look, ask)
        self.last_trace = trace
        self.wait_for_rest()
        in_bin, left = self._clear(set(carried))
        held_id = _choose_held(carried, in_bin, plan.object_id if true_id is None else true_id)
        held, delivered = held_id is not None, held_id in in_bin
        if delivered:
            result = PickResult.RETRIEVED if held_id == TARGET_ID else PickResult.REMOVED
        elif trace.result in (PickResult.STOPPED, PickResult.NOT_REACHED):
            result = trace.result
        else:
            result = PickResult.SLIPPED if held else PickResult.MISSED
        return PickOutcome(
            result=result,
            object_id=plan.object_id,
            held_id=held_id,
            held_after_lift=held,
            delivered=delivered,
            dropped=tuple(i for i in left if i != TARGET_ID),
            target_lost=TARGET_ID in left,
            detail=trace.detail,
            duration_s=self.world.time_s - start_s,
            at_home=trace.at_home,
            touch=trace.touch,
            felt=FeltOutcome(trace.result, trace.held_after_lift, trace.delivered),
            true_id=true_id,
        )

    def remove(self, object_ids: Iterable[int]) -> None:
        """Take objects out of the scene as no robot can, and let the others come to rest, to see what would follow.

        Raises PhysicsError if the simulation broke.
        """
        for object_id in object_ids:
            self.world.park(object_id, Presence.DELIVERED)
        self.world.update_position_stage()
        self.wait_for_rest()
        self._clear(set())

    def wait_for_rest(self) -> float:
        """Run until the scene is at rest, or config.rest.limit_s is over. Returns the simulated time it took."""
        rest, elapsed, quiet = self.config.rest, 0.0, 0.0
        while elapsed < rest.limit_s and quiet < rest.quiet_s:
            self._stepper.run(rest.check_s)
            elapsed += rest.check_s
            calm = self.world.speeds(rest.radius_m).max(initial=0.0) < rest.speed_m_s
            quiet = quiet + rest.check_s if calm else 0.0
        return elapsed

    def save(self) -> RobotState:
        """Return the state of robot and world, between two picks."""
        return RobotState(save_state(self.world), self.gripper.save(), self._stepper.save())

    def restore(self, state: RobotState) -> None:
        """Continue from a saved state, bit for bit; it may come from another robot in a world built alike.

        Raises InputError if it belongs to another world.
        """
        restore_state(self.world, state.world)
        self.gripper.restore(state.grip)
        self._stepper.restore(state.stepper)
        self.last_trace = None

    def close(self) -> None:
        """Free what the camera holds."""
        self.camera.close()

    def _clear(self, carried: set[int]) -> tuple[set[int], tuple[int, ...]]:
        """Remove from the scene what left the table: what the gripper carried to the bin, and what left otherwise."""
        gone = self.world.off_table()
        delivered = carried & set(self.world.in_bin())
        for object_id in gone:
            self.world.park(object_id, Presence.DELIVERED if object_id in delivered else Presence.DROPPED)
        self.world.update_position_stage()
        return delivered, tuple(i for i in gone if i not in delivered)


def _choose_held(carried: dict[int, bool], delivered: set[int], wanted: int) -> int | None:
    """Return the lifted object that counts: a delivered target, the wanted one, the target, any that is touched."""
    if TARGET_ID in delivered:
        return TARGET_ID
    for candidate in (wanted, TARGET_ID):
        if candidate in carried:
            return candidate
    return min(carried, key=lambda i: (not carried[i], i), default=None)


class SimulatedCamera(Closing):
    """The `Camera` of torc.robots.protocols: exact colour, depth and labels. Close it, or use it in a `with`."""

    def __init__(
        self, world: World, backend: str | None = None, color: bool = True, rig: StereoRig | None = None
    ) -> None:
        """Look from the workspace's mount; GL starts at the first picture.

        Without colour it may be black. With a rig, snapshots also hold a stereo pair.
        """
        self._world, self._backend, self._color, self._rig = world, backend, color or rig is not None, rig
        self._renderer: CameraRenderer | None = None

    def capture(self) -> Capture:
        """Return one snapshot, taken now, with its true labels.

        Raises MissingDependencyError if the chosen backend does not work here.
        """
        mount = self._world.workspace.camera
        if self._renderer is None:
            self._renderer = CameraRenderer(self._world, mount, self._backend)
        view = self._renderer.render(color=self._color)
        pair = None if self._rig is None else self._pair(self._rig, self._renderer, view)
        observation = Observation(
            pair=pair,
            rgb=view.rgb,
            depth_m=view.depth_m,
            K=mount.K,
            T_world_camera=mount.T_world_camera,
            qpos=self._arm_qpos(),
            stamp_s=self._world.time_s,
        )
        return Capture(observation, view.label_image)

    def close(self) -> None:
        """Free GL; the next capture starts it again."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _pair(self, rig: StereoRig, renderer: CameraRenderer, left: View) -> StereoPair:
        mount = self._world.workspace.camera
        T = mount.T_world_camera.copy()
        T[:3, 3] += rig.baseline_m * T[:3, 0]
        right = renderer.render(T)
        # The noise depends only on the moment: a trial that is played again sees identical noise.
        rng = np.random.default_rng([_NOISE, round(1e6 * self._world.time_s)])
        return stereo_pair(rig, (left.rgb, right.rgb), (left.depth_m, right.depth_m), mount.K, rng)

    def _arm_qpos(self) -> np.ndarray:
        robot = self._world.robot
        if robot is None:
            return np.zeros(0)
        return np.array([self._world.data.joint(name).qpos[0] for name in robot.arm.joint_names])


def as_simulated(camera: SimulatedCamera) -> SimulatedCamera:
    """Return the simulated camera itself, the default of the stage `camera`."""
    return camera
