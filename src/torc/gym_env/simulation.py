"""Where the episodes of an environment take place."""

import sys

from torc.episode.loop import Episode, rehearse
from torc.episode.simulated import needs_color, pick_parts, simulated_robot
from torc.episode.steps import EpisodeConfig, Steps
from torc.pipeline.building import build_system
from torc.pipeline.warm_up import announced_compilation
from torc.problems.problem import load_problem
from torc.sim.closing import Closing
from torc.sim.robot import RobotState, SimulatedRobot
from torc.specs.conditions import Conditions


class EpisodeSimulation(Closing):
    """Episodes with the parts that `run_trial` puts together: the same problem, seed and picks go the same way.

    The world of the latest problem is kept: another episode in it need not be built anew.
    """

    def __init__(self, conditions: Conditions, *, color: bool) -> None:
        """Without `color`, where no pictures are needed, each look is faster. Raises InputError."""
        self._system = build_system(conditions)
        self._color = color or needs_color(self._system)
        self._open: tuple[str, SimulatedRobot, RobotState] | None = None  # problem, robot, state as built
        self._rehearsed = False

    def begin(self, problem: str, config: EpisodeConfig) -> Episode:
        """The episode of a problem, before its first look; the one before it is over. The first one compiles kernels
        where they are not cached, and says so on stderr.

        Raises InputError for a problem that cannot be used, and PhysicsError if it breaks before the first pick.
        """
        if self._open is None or self._open[0] != problem:
            self.close()
            simulated = simulated_robot(self._system, load_problem(problem), color=self._color)
            self._open = problem, simulated, simulated.save()
        _, simulated, built = self._open
        simulated.restore(built)
        simulated.take_over()
        parts = pick_parts(self._system, simulated)
        if not self._rehearsed:
            with announced_compilation(lambda text: print(text, file=sys.stderr)):
                rehearse(parts)
            self._rehearsed = True
        return Episode(Steps(parts, simulated.world.problem.description, config))

    def close(self) -> None:
        """Frees the world and its camera."""
        if self._open is not None:
            self._open[1].close()
            self._open = None
