"""The simulated world behind the twins, which advances in real time.

Only one thread touches the world. Others read the state that it last stored, and queue tasks between two steps.
"""

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np

from torc import InputError, Problem, TorcError
from torc.records import TARGET_ID, Capture
from torc.robots.description import RobotDescription
from torc.sim.actuation import SimulatedArm, SimulatedGripper
from torc.sim.robot import SimulatedCamera
from torc.sim.simulated_world import Presence, build_world
from torc.sim.stepping import Stepper
from torc.workspace.description import Workspace
from torc_lab.robotiq.gripper import FORCE_N, WidthScale
from torc_lab.robotiq.registers import Object

_MOST_BEHIND_S = 0.25
"""A longer backlog is dropped, for example after a picture."""
_CALM_M_S, _BELOW_M = 0.05, 0.05
_STILL_M_S, _STILL_S = 0.003, 0.08
_ARRIVED_COUNTS = 3
_DISTURBED_M, _CLEAR_M = 0.03, 0.002
"""A push moves an object this far, and lifts it this much so that it does not catch."""
_STARTS_S = 60.0
_PICTURE_S = 20.0
T = TypeVar("T")


@dataclass(frozen=True)
class Truth:
    """The true outcome: ids of the objects in the bin, and of those that fell off the table."""

    in_bin: tuple[int, ...]
    dropped: tuple[int, ...]

    @property
    def retrieved(self) -> bool:
        """Return whether the target is in the bin."""
        return TARGET_ID in self.in_bin


class LiveWorld:
    """Simulates a problem with a robot in real time, during a `with`. It is an `ArmBehind` and `Fingers` of
    torc_lab.twin.base, and a `Camera`.
    """

    def __init__(self, problem: Problem, robot: RobotDescription, workspace: Workspace) -> None:
        self._made_of = problem, robot, workspace
        self._thread = ThreadPoolExecutor(1, "torc-twin-world")
        self._ending, self._broken = False, ""
        self._lock = threading.Lock()
        self._goal: np.ndarray | None = None
        self._fingers: tuple[int, int] | None = None
        self._qpos = robot.arm.rest_qpos.copy()
        self._found = (0, Object.AT_POSITION)
        self._scale = WidthScale(max_width_m=robot.gripper.max_width_m)
        self._felt, self._contact_n = False, 0.0
        self._in_bin: list[int] = []
        self._dropped: list[int] = []

    def __enter__(self) -> Self:
        """Build the world and start it. Raises InputError if the problem cannot be built."""
        self._ask(self._begin, _STARTS_S)
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.submit(self._end)
        self._thread.shutdown()

    @property
    def qpos(self) -> np.ndarray:
        """Return the joint positions, radians."""
        self._check()
        return self._qpos

    def goal(self, qpos: np.ndarray) -> None:
        """Set where the arm has to be now, radians."""
        self._goal = np.array(qpos)

    @property
    def contact_n(self) -> float:
        """Return the force at the hardest contact, except with the held object, newtons; 0 on the first call."""
        self._felt = True
        return self._contact_n

    def go(self, position: int, speed: int, force: int) -> None:
        """Start moving the fingers towards a position."""
        with self._lock:
            self._fingers = position, force
            self._found = self._found[0], Object.MOVING

    def now(self) -> tuple[int, Object]:
        """Return the position, and whether something stopped the fingers."""
        self._check()
        with self._lock:
            return self._found

    def capture(self) -> Capture:
        """Return a snapshot, while the world waits. Objects at rest in the bin or below the table are removed first."""

        def look() -> Capture:
            self._cleared()
            return self._camera.capture()

        return self._ask(look)

    def truth(self, after_s: float = 1.0) -> Truth:
        """Return the true outcome so far, after waiting `after_s` seconds for objects that still fall."""
        time.sleep(after_s)
        return self._ask(self._cleared)

    def reset(self) -> None:
        """Lay the scene out again, as a person would: all objects are at rest at the problem's poses. The arm stays
        where it is.
        """

        def lay_out() -> None:
            for k, (position, wxyz) in enumerate(zip(*self._first, strict=True)):
                self._world.unpark(k, position, wxyz)
            self._in_bin.clear()
            self._dropped.clear()
            self._world.update_position_stage()

        self._ask(lay_out)

    def disturb(self, object_id: int | None = None, by_m: float = _DISTURBED_M) -> int:
        """Push an object aside, away from the others, and return its id. Without an id, the highest one is pushed.
        Raises InputError if that object is no longer on the table.
        """

        def push() -> int:
            world = self._world
            there, places = world.on_table(), world.positions
            if not there or (object_id is not None and object_id not in there):
                raise InputError(f"No such object is on the table; there are {list(there)}.")
            k = max(there, key=lambda i: places[i, 2]) if object_id is None else object_id
            away = places[k, :2] - places[list(there), :2].mean(axis=0)
            away = away / (np.linalg.norm(away) or 1.0)
            world.set_object_pose(k, places[k] + [*(by_m * away), _CLEAR_M], world.wxyz[k])
            world.update_position_stage()
            return k

        return self._ask(push)

    def _ask(self, task: Callable[[], T], limit_s: float = _PICTURE_S) -> T:
        """Run a task on the world's thread and return its result. Raises TorcError, and any error of the task."""
        self._check()
        try:
            return self._thread.submit(task).result(limit_s)
        except TimeoutError:
            raise TorcError(f"The simulated world did not answer within {limit_s:g} s.") from None

    def _check(self) -> None:
        if self._broken:
            raise TorcError(f"The simulated world broke: {self._broken}.")

    def _begin(self) -> None:
        problem, robot, workspace = self._made_of
        world = build_world(problem, robot, workspace)
        self._world, self._stepper = world, Stepper(world)
        self._first = world.positions.copy(), world.wxyz.copy()
        self._gripper = SimulatedGripper(self._stepper, robot)
        self._arm = SimulatedArm(self._stepper, robot, self._gripper)
        self._gripper.begin_opening(self._gripper.max_width_m)
        self._camera = SimulatedCamera(world)
        self._began = time.monotonic() - world.time_s
        self._rest_since, self._width = world.time_s, self._gripper.width_m
        self._thread.submit(self._go_on)

    def _end(self) -> None:
        self._ending = True
        self._camera.close()

    def _go_on(self) -> None:
        """Advance by a step if the world is behind the clock, else wait; then queue itself after all waiting tasks."""
        if self._ending:
            return
        try:
            behind_s = time.monotonic() - self._began - self._world.time_s
            self._began += max(0.0, behind_s - _MOST_BEHIND_S)
            if behind_s < self._stepper.period_s:
                time.sleep(0.002)
            else:
                self._step()
        except Exception as error:  # whoever asks must hear of it
            self._broken = str(error) or type(error).__name__
        else:
            self._thread.submit(self._go_on)

    def _step(self) -> None:
        if self._goal is not None:
            self._arm.command(self._goal)
        with self._lock:
            fingers = self._fingers
        if fingers is not None and fingers[0] >= self._scale.closed_count:
            low, high = FORCE_N
            self._gripper.begin_closing(low + fingers[1] / 255 * (high - low))
        elif fingers is not None:
            self._gripper.begin_opening(self._scale.width_m(fingers[0]))
        self._stepper.step()
        self._qpos = self._arm.qpos
        if self._felt:
            self._contact_n = self._arm.contact_n
        if fingers is not None:
            self._feel_fingers(fingers)

    def _feel_fingers(self, fingers: tuple[int, int]) -> None:
        """Store the fingers' state, once per step."""
        state, now_s = self._gripper.state, self._world.time_s
        width = state.width_m
        if abs(width - self._width) > _STILL_M_S * self._stepper.period_s:
            self._rest_since = now_s
        self._width = width
        count = self._scale.count(min(width, self._scale.max_width_m))
        with self._lock:
            if self._fingers != fingers:  # told something else meanwhile
                self._rest_since = now_s
                return
            if now_s - self._rest_since < _STILL_S:
                self._found = count, Object.MOVING
                return
            wanted = min(fingers[0], self._scale.closed_count)
            found = Object.STOPPED_CLOSING if count < wanted else Object.STOPPED_OPENING
            empty = self._gripper.closed and not state.holding
            arrived = empty or abs(count - wanted) <= _ARRIVED_COUNTS
            self._found = count, Object.AT_POSITION if arrived else found

    def _cleared(self) -> Truth:
        """Remove objects that have come to rest in the bin or below the table; return the true outcome."""
        world = self._world
        in_bin, calm = set(world.in_bin()), world.speeds() < _CALM_M_S
        below = world.positions[:, 2] < world.workspace.support_z_m - _BELOW_M
        for k in world.off_table():
            if not calm[k] or not (k in in_bin or below[k]):
                continue
            (self._in_bin if k in in_bin else self._dropped).append(k)
            world.park(k, Presence.DELIVERED if k in in_bin else Presence.DROPPED)
        world.update_position_stage()
        return Truth(tuple(self._in_bin), tuple(self._dropped))
