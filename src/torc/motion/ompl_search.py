"""RRT-Connect of OMPL around our compiled edge check."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from jaxtyping import Float
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from torc.motion.config import SearchConfig
from torc.motion.queries import MotionQuery
from torc.motion.space import FreeSpace


def compiled_edges(si: "ob.SpaceInformation", space: FreeSpace) -> None:
    """Tells OMPL to check configurations and edges by the compiled checks."""
    validator = _EdgeValidator(si, space)
    si.setMotionValidator(validator)
    si.setStateValidityChecker(validator.state_free)


def ompl_search(
    query: MotionQuery,
    config: SearchConfig,
    rng: np.random.Generator,
    validate: Callable[["ob.SpaceInformation", FreeSpace], None] = compiled_edges,
) -> Float[np.ndarray, "m dof"] | None:
    """`PathSearch` by OMPL. `validate` tells OMPL how to check.

    OMPL seeds each of its generators from a global one, which is set here from rng: so equal queries have equal
    answers within and across processes.
    """
    with _quiet_and_seeded(int(rng.integers(1, 2**31 - 1))):
        return _solve(query, config, validate)


def configuration(state: "ob.State", dof: int) -> Float[np.ndarray, "dof"]:
    """An OMPL state as an array."""
    return np.array([state[i] for i in range(dof)])


def _solve(
    query: MotionQuery, config: SearchConfig, validate: Callable[["ob.SpaceInformation", FreeSpace], None]
) -> Float[np.ndarray, "m dof"] | None:
    space, dof = query.space, len(query.start)
    state_space = ob.RealVectorStateSpace(dof)
    bounds = ob.RealVectorBounds(dof)
    for i in range(dof):
        bounds.setLow(i, float(space.lower[i]))
        bounds.setHigh(i, float(space.upper[i]))
    state_space.setBounds(bounds)
    si = ob.SpaceInformation(state_space)
    validate(si, space)
    si.setup()
    problem = ob.ProblemDefinition(si)
    problem.addStartState(_state(state_space, query.start))
    goal = ob.GoalStates(si)
    for q in query.goals:
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
    return np.array([configuration(s, dof) for s in problem.getSolutionPath().getStates()])


class _EdgeValidator(ob.MotionValidator):
    """Edges by the compiled check."""

    def __init__(self, si: "ob.SpaceInformation", space: FreeSpace) -> None:
        super().__init__(si)
        self.space, self.dof = space, len(space.lower)

    def checkMotion(self, a: "ob.State", b: "ob.State") -> bool:
        """Whether the straight edge is free."""
        return self.space.edge_free(configuration(a, self.dof), configuration(b, self.dof))

    def state_free(self, state: "ob.State") -> bool:
        """Whether one configuration is free."""
        return not self.space.collides(configuration(state, self.dof)[None])[0]


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
