"""Where the episodes of an environment take place."""

import sys
from dataclasses import dataclass
from typing import Protocol

from torc.episode.loop import rehearse_picks
from torc.episode.steps import EpisodeConfig, PickParts, Steps
from torc.episode.stepwise import Episode
from torc.motion.planner import OmplMotionPlanner
from torc.pipeline.defaults import default_pipeline
from torc.pipeline.warm_up import announced_compilation
from torc.robots.loading import load_robot
from torc.scenes.problem import load_problem
from torc.scenes.workspace import Workspace
from torc.sim.closing import Closing
from torc.sim.robot import RobotState, SimulatedRobot, SimulatedRobotConfig
from torc.sim.world import build_world


class Playground(Protocol):
    """Begins episodes, one at a time."""

    def begin(self, problem: str, config: EpisodeConfig) -> Episode:
        """The episode of a problem, before its first look. The one before it is over."""
        ...

    def close(self) -> None:
        """Frees what it holds."""
        ...


@dataclass(frozen=True)
class _OpenWorld:
    """A problem's world, and how it was when it was built."""

    problem: str
    robot: SimulatedRobot
    built: RobotState


class SimulatedPlayground(Closing):
    """The simulation, with the parts that `run_trial` puts together: the same problem, seed and picks go the same way.

    The world of the latest problem is kept: another episode in it need not be built anew.
    """

    def __init__(self, *, noise: bool, min_score: float, robot: str, color: bool) -> None:
        """color: whether pictures are needed; without, each look is faster. The others as in `TrialSpec`.

        Raises:
            InputError: the robot or min_score cannot be used.
        """
        self._robot, self._workspace = load_robot(robot), Workspace()
        self._pipeline = default_pipeline(self._robot, self._workspace, noise=noise, min_score=min_score)
        self._motion_planner = OmplMotionPlanner(self._robot, self._workspace)
        self._config = SimulatedRobotConfig(color=color)
        self._open: _OpenWorld | None = None
        self._rehearsed = False

    def begin(self, problem: str, config: EpisodeConfig) -> Episode:
        """As Playground says. The first episode compiles kernels where they are not cached, and says so on stderr.

        Raises:
            InputError: the problem cannot be used.
            PhysicsError: the simulation broke before the first pick.
        """
        simulated = self._as_built(problem)
        simulated.take_over()
        parts = PickParts(simulated, self._pipeline, self._motion_planner)
        if not self._rehearsed:
            with announced_compilation(lambda text: print(text, file=sys.stderr)):
                rehearse_picks(parts)
            self._rehearsed = True
        return Episode(Steps(parts, simulated.world.problem.description, config))

    def close(self) -> None:
        """Frees the world and its camera."""
        if self._open is not None:
            self._open.robot.close()
            self._open = None

    def _as_built(self, problem: str) -> SimulatedRobot:
        """The robot in the problem's world, as that was built."""
        if self._open is None or self._open.problem != problem:
            self.close()
            world = build_world(load_problem(problem), self._robot, self._workspace)
            simulated = SimulatedRobot(world, self._config)
            self._open = _OpenWorld(problem, simulated, simulated.save())
        self._open.robot.restore(self._open.built)
        return self._open.robot
