"""RRT-Connect of OMPL around our compiled edge check."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from jaxtyping import Float
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from torc.motion.config import SearchConfig
from torc.motion.space import FreeSpace


def ompl_search(
    space: FreeSpace,
    start: Float[np.ndarray, "dof"],
    goals: Float[np.ndarray, "g dof"],
    config: SearchConfig,
    rng: np.random.Generator,
) -> Float[np.ndarray, "m dof"] | None:
    """A free path from start to one of the goals, or None after config.max_iterations samples.

    Start and goals must be free. OMPL seeds each of its generators from a global one, which is set here from
    rng: so equal queries have equal answers within and across processes.
    """
    with _quiet_and_seeded(int(rng.integers(1, 2**31 - 1))):
        return _solve(space, start, goals, config)


def _solve(
    space: FreeSpace, start: np.ndarray, goals: np.ndarray, config: SearchConfig
) -> Float[np.ndarray, "m dof"] | None:
    dof = len(start)
    state_space = ob.RealVectorStateSpace(dof)
    bounds = ob.RealVectorBounds(dof)
    for i in range(dof):
        bounds.setLow(i, float(space.lower[i]))
        bounds.setHigh(i, float(space.upper[i]))
    state_space.setBounds(bounds)
    si = ob.SpaceInformation(state_space)
    validator = _EdgeValidator(si, space, dof)
    si.setMotionValidator(validator)
    si.setStateValidityChecker(validator.state_free)
    si.setup()
    problem = ob.ProblemDefinition(si)
    problem.addStartState(_state(state_space, start))
    goal = ob.GoalStates(si)
    for q in goals:
        goal.addState(_state(state_space, q))
    problem.setGoal(goal)
    planner = og.RRTConnect(si)
    planner.setRange(config.range_rad)
    planner.setProblemDefinition(problem)
    planner.setup()
    left = [config.max_iterations]

    def exhausted() -> bool:
        left[0] -= 1
        return left[0] < 0

    planner.solve(ob.PlannerTerminationCondition(exhausted))
    if not problem.hasExactSolution():
        return None
    states = problem.getSolutionPath().getStates()
    return np.array([[s[i] for i in range(dof)] for s in states])


class _EdgeValidator(ob.MotionValidator):
    """Edges by the compiled check."""

    def __init__(self, si: "ob.SpaceInformation", space: FreeSpace, dof: int) -> None:
        super().__init__(si)
        self.space, self.dof = space, dof

    def checkMotion(self, a: "ob.State", b: "ob.State") -> bool:
        """Whether the straight edge is free."""
        return self.space.edge_free(self._array(a), self._array(b))

    def state_free(self, state: "ob.State") -> bool:
        """Whether one configuration is free."""
        return not self.space.collides(self._array(state)[None])[0]

    def _array(self, state: "ob.State") -> Float[np.ndarray, "dof"]:
        return np.array([state[i] for i in range(self.dof)])


def _state(state_space: "ob.StateSpace", q: np.ndarray) -> "ob.State":
    state = state_space.allocState()
    for i, value in enumerate(q):
        state[i] = float(value)
    return state


@contextmanager
def _quiet_and_seeded(seed: int) -> Iterator[None]:
    """OMPL without messages (it warns of every change of its seed) and with its global seed set."""
    level = ou.getLogLevel()
    ou.setLogLevel(ou.LOG_NONE)
    try:
        ou.RNG.setSeed(seed)
        yield
    finally:
        ou.setLogLevel(level)
