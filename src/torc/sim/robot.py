"""The simulated robot: looks, carries out picks, and knows the truth about what came of them."""

from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

import numpy as np

from torc.records import TARGET_ID, Observation, PickOutcome, PickPlan, PickResult
from torc.robots.description import RobotDescription
from torc.robots.execution import ExecutionConfig, ExecutionTrace, Phase, PhaseTrace, execute_pick
from torc.sim.actuation import ActuationConfig, SimulatedArm, SimulatedGripper
from torc.sim.camera import SimulatedCamera
from torc.sim.contacts import ContactReader
from torc.sim.settling import SettleConfig
from torc.sim.stepping import Observer, Stepper, StepperConfig
from torc.sim.world import Presence, World


@dataclass(frozen=True)
class SimulatedRobotConfig:
    """The simulated robot.

    Attributes:
        stepper: control period, watchdog, observer.
        actuation: servos and gripper.
        execution: the sequence of a pick, e.g. grip force and contact guard.
        rest: when the scene counts as at rest after a pick, and how long to wait for it at most.
        risen_m: an object that is this much higher after the lift is held, if it touches the gripper.
        backend: how to render; None for the best there is.
    """

    stepper: StepperConfig = field(default_factory=StepperConfig)
    actuation: ActuationConfig = field(default_factory=ActuationConfig)
    execution: ExecutionConfig = field(default_factory=ExecutionConfig)
    rest: SettleConfig = field(default_factory=lambda: SettleConfig(limit_s=1.5))
    risen_m: float = 0.02
    backend: str | None = None


class SimulatedRobot:
    """The `Robot` of torc.robots.protocols in a simulated world. Close it, or use it in a `with`.

    Objects that are delivered, or that left the table otherwise, are out of the scene after the pick.
    """

    def __init__(
        self, world: World, config: SimulatedRobotConfig | None = None, observer: Observer | None = None
    ) -> None:
        """Takes over a world that was built with a robot.

        Args:
            world: the world; nobody else should step it.
            config: see there.
            observer: called with the world about 25 times per simulated second, e.g. to record a video.

        Raises:
            ValueError: the world has no robot.
        """
        if world.robot is None:
            raise ValueError("The world was built without a robot.")
        self.world, self.config, self._description = world, config or SimulatedRobotConfig(), world.robot
        self._stepper = Stepper(world, self.config.stepper, observer)
        self.gripper = SimulatedGripper(self._stepper, world.robot, self.config.actuation)
        self.arm = SimulatedArm(self._stepper, world.robot, self.gripper, self.config.actuation)
        self.camera = SimulatedCamera(world, self.config.backend)
        self._contacts = ContactReader(world, world.robot)
        self.last_trace: ExecutionTrace | None = None
        """What was commanded in the latest pick, and what the robot itself felt."""

    @property
    def description(self) -> RobotDescription:
        """Kinematics and shape."""
        return self._description

    def capture(self) -> Observation:
        """One snapshot, now."""
        return self.camera.capture()

    def execute(self, plan: PickPlan) -> PickOutcome:
        """Carries out one pick and tells what came of it, by the simulator's truth.

        Raises:
            InputError: the plan does not start where the arm is.
            PhysicsError: the simulation broke.
        """
        start_s = self.world.time_s
        heights_before = self.world.positions[:, 2]
        carried: dict[int, bool] = {}

        def look(step: PhaseTrace) -> None:
            if step.phase is Phase.LIFT:
                carried.update(self._contacts.carried(heights_before, self.config.risen_m))

        trace = execute_pick(self.arm, self.gripper, plan, self.config.execution, look)
        self.last_trace = trace
        self.wait_for_rest()
        delivered, left = self._clear(set(carried))
        held_id = _choose_held(carried, delivered, plan.object_id)
        return _outcome(plan, trace, held_id, held_id in delivered, left, self.world.time_s - start_s)

    def wait_for_rest(self) -> float:
        """Runs until the scene is at rest, or config.rest.limit_s is over. Returns the simulated time it took."""
        rest, elapsed, quiet = self.config.rest, 0.0, 0.0
        while elapsed < rest.limit_s and quiet < rest.quiet_s:
            self._stepper.run(rest.check_s)
            elapsed += rest.check_s
            calm = self.world.speeds(rest.radius_m).max(initial=0.0) < rest.speed_m_s
            quiet = quiet + rest.check_s if calm else 0.0
        return elapsed

    def close(self) -> None:
        """Frees what the camera holds."""
        self.camera.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _clear(self, carried: set[int]) -> tuple[set[int], tuple[int, ...]]:
        """Takes what left the table out of the scene: what the gripper carried to the bin, and what left otherwise."""
        on_table, in_bin = set(self.world.on_table()), set(self.world.in_bin())
        gone = [i for i in np.flatnonzero(self.world.present).tolist() if i not in on_table]
        delivered = carried & in_bin
        for object_id in gone:
            self.world.park(object_id, Presence.DELIVERED if object_id in delivered else Presence.DROPPED)
        self.world.update_position_stage()
        return delivered, tuple(i for i in gone if i not in delivered)


def _choose_held(carried: dict[int, bool], delivered: set[int], wanted: int) -> int | None:
    """Of all that came up, the one that counts: a delivered target, the wanted one, the target, what the gripper
    touches."""
    if TARGET_ID in delivered:
        return TARGET_ID
    for candidate in (wanted, TARGET_ID):
        if candidate in carried:
            return candidate
    return min(carried, key=lambda i: (not carried[i], i), default=None)


def _outcome(
    plan: PickPlan,
    trace: ExecutionTrace,
    held_id: int | None,
    delivered: bool,
    left: tuple[int, ...],
    duration_s: float,
) -> PickOutcome:
    """The truth, in words of the record. What the robot felt decides only why it stopped."""
    held = held_id is not None and trace.held_after_lift
    if delivered:
        result = PickResult.RETRIEVED if held_id == TARGET_ID else PickResult.REMOVED
    elif trace.result is PickResult.STOPPED:
        result = PickResult.STOPPED
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
        duration_s=duration_s,
    )
