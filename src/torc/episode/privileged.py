"""What privileged parts of a trial may know and try: the true present, and the outcomes of picks.

A part with a method `attach` receives a `Simulation` before the first pick; a real robot has none.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np

from torc.episode.events import Event, Looked
from torc.episode.simulated import needs_color, simulated_robot, wanted_in
from torc.episode.steps import EpisodeConfig, Steps
from torc.occlusion.room import places_left
from torc.pipeline.building import System
from torc.pipeline.look import Look
from torc.pipeline.state import EpisodeState, first_state
from torc.problems.problem import Problem
from torc.records import TARGET_ID, Decision, PickOutcome, PickResult, PlanningContext
from torc.sim.contacts import lies_on
from torc.sim.robot import RobotState, SimulatedRobot
from torc.sim.visibility import Visibility, filled_voxels, measure_visibility


@dataclass(frozen=True)
class SimulatedState:
    """Everything between two picks that decides what can follow."""

    robot: RobotState
    episode: EpisodeState

    def same_as(self, other: "SimulatedState") -> bool:
        """Check whether an equal number of picks led to the same world, bit for bit."""
        same_picks = self.episode.outcomes == other.episode.outcomes
        return same_picks and np.array_equal(self.robot.world, other.robot.world)


@dataclass(frozen=True)
class Truth:
    """What no picture shows: how much of each object the camera could see and what hides the rest.

    `lies_on` holds (upper, lower) pairs of objects.
    """

    visibility: Visibility
    lies_on: frozenset[tuple[int, int]]


class Sandbox:
    """A separate world in which an episode can continue from any state, as the trial would continue it."""

    def __init__(self, robot: SimulatedRobot, steps: Steps, built: RobotState | None = None) -> None:
        """Wrap a robot and the steps that use it; only the sandbox may use the robot.

        Its world must be as built, unless `built` gives that state.
        """
        self._robot, self._steps = robot, steps
        self._built = robot.save() if built is None else built

    @property
    def absent(self) -> bool:
        """True if the problem has no target."""
        return self._robot.world.problem.absent

    def now(self, state: SimulatedState) -> SimulatedState:
        """Return the state of the episode with the present world."""
        return replace(state, robot=self._robot.save())

    def with_draws(self, seed: int) -> "Sandbox":
        """Return a sandbox on this world whose looks and plans draw with another seed. Use the two in turns."""
        config = replace(self._steps.config, seed=seed)
        return Sandbox(
            self._robot, Steps(self._robot, self._steps.system, self._steps.wanted, config), self._built
        )

    def begin(self) -> SimulatedState:
        """Return the state before the first pick, as a trial begins.

        Raises InputError if the target does not stay on the table, and PhysicsError if the simulation broke.
        """
        self._robot.restore(self._built)
        self._robot.take_over()
        return SimulatedState(self._robot.save(), first_state(self._robot.world.workspace.grid))

    def look(self, state: SimulatedState) -> Look:
        """Return what the robot would see; the picture may be black."""
        self._robot.restore(state.robot)
        return self._steps.look(state.episode)

    def truth(self, state: SimulatedState) -> Truth:
        """Return who hides whom, and who lies on whom."""
        self._robot.restore(state.robot)
        world = self._robot.world
        return Truth(measure_visibility(world, world.workspace.camera), lies_on(world))

    def nowhere(self, state: SimulatedState, context: PlanningContext) -> bool:
        """Check whether the target is certainly absent.

        True if it is, and someone who knew the shapes of all objects could find no place for it in what is still
        unseen.
        """
        self._robot.restore(state.robot)
        world = self._robot.world
        if not world.problem.absent:
            return False
        unseen = ~context.volume.seen & ~filled_voxels(world)
        grid = context.volume.grid
        return places_left(unseen, world.models[TARGET_ID], grid.voxel_size_m) == 0

    def pick(self, state: SimulatedState, look: Look, object_id: int | None) -> SimulatedState:
        """Return the state after a pick, given the look before it; None lets the pick pass. Raises PhysicsError."""
        self._robot.restore(state.robot)
        episode = self._steps.attempt(state.episode, look, Decision(object_id, "to see what comes of it"))
        return SimulatedState(self._robot.save(), episode)

    def look_without(self, state: SimulatedState, object_ids: Iterable[int]) -> Look:
        """Return what the robot would see without these objects, about as after picking them. Raises PhysicsError."""
        gone = sorted(object_ids)
        self._take_away(state, gone)
        # Count the picks as made, so that the random draws are those of the look then.
        picked = tuple(PickOutcome(PickResult.REMOVED, k, k, True, True) for k in gone)
        return self._steps.look(replace(state.episode, outcomes=state.episode.outcomes + picked))

    def looks_without(
        self, state: SimulatedState, object_ids: Iterable[int], seeds: Iterable[int]
    ) -> Iterator[Look]:
        """Yield what the robot would see if these objects were gone, once with the grasps that each seed draws.

        A seed draws the same grasps whatever is gone. All looks use one picture, taken when the first is requested.
        Raises PhysicsError.
        """
        self._take_away(state, sorted(object_ids))
        yield from self._steps.looks(state.episode, seeds)

    def _take_away(self, state: SimulatedState, object_ids: list[int]) -> None:
        self._robot.restore(state.robot)
        self._robot.remove(object_ids)


class Simulation:
    """A trial in progress, for its privileged parts, which can try picks in its `sandbox`. A listener of the trial."""

    def __init__(
        self, robot: SimulatedRobot, sandbox: Sandbox, config: EpisodeConfig, say: Callable[[str], None]
    ) -> None:
        """Take the trial's own robot, not the sandbox's; `say` is for progress, a line at a time."""
        self.problem, self.sandbox, self.config, self.say = robot.world.problem, sandbox, config, say
        self._robot = robot
        self._state = first_state(robot.world.workspace.grid)

    def __call__(self, event: Event) -> None:
        """Remember the episode's state."""
        if isinstance(event, Looked):
            self._state = event.state

    def now(self) -> SimulatedState:
        """Return the present, between two picks."""
        return SimulatedState(self._robot.save(), self._state)

    def truth(self) -> Truth:
        """Return what no picture of the present shows. The trial's own world is not touched."""
        return self.sandbox.truth(self.now())


@runtime_checkable
class Privileged(Protocol):
    """A part of a trial that may look into the simulation."""

    def attach(self, simulation: Simulation) -> None:
        """Take the trial's simulation; called once, before the first look."""


@contextmanager
def open_sandbox(
    problem: Problem, system: System, config: EpisodeConfig, *, color: bool = False
) -> Iterator[Sandbox]:
    """Open a sandbox for a problem that looks, plans and picks as in a trial with these parts.

    `color`: pictures are not black, even if no part needs them.
    """
    # The color picture takes most of the camera's time.
    with simulated_robot(system, problem, color=color or needs_color(system)) as simulated:
        steps = Steps(simulated, system, wanted_in(system, problem), config)
        yield Sandbox(simulated, steps)
