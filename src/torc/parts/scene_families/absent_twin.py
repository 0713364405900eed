"""The same scenes as absent, from the same seeds, with the target in them."""

from torc.generation.inspection import Inspector
from torc.parts.scene_families.absent import Absent
from torc.problems.problem import Problem
from torc.sim.settling import StillnessConfig


class AbsentTwin(Absent):
    """Leaves the target where it is."""

    def finished(self, problem: Problem, inspector: Inspector, stillness: StillnessConfig) -> Problem:
        """Return the problem itself. Raises RejectedError where its twin is rejected."""
        super().finished(problem, inspector, stillness)
        return problem


PART = AbsentTwin
