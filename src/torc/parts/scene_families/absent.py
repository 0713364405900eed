"""The target is not there, and the first look does not show it."""

from dataclasses import replace

from torc.generation.config import Hiddenness, Reason, RejectedError
from torc.generation.families import SceneFamily
from torc.generation.inspection import Inspector
from torc.problems.problem import Problem
from torc.sim.settling import UNSEEN, StillnessConfig, watch_stillness
from torc.sim.simulated_world import build_world


class Absent(SceneFamily):
    """Takes the target away. The scene must stay as it is without it, or the look would show that it is gone."""

    hidden = Hiddenness.HIDDEN
    unseen = True

    def finished(self, problem: Problem, inspector: Inspector, stillness: StillnessConfig) -> Problem:
        """Return the problem without its target. Raises RejectedError if something moves then."""
        rest = tuple(o for o in problem.objects if o.name != problem.target)
        model = next(o.model for o in problem.objects if o.name == problem.target)
        gone = replace(problem, objects=rest, target_model=model)
        if not watch_stillness(build_world(gone, None, inspector.workspace, UNSEEN), stillness).still:
            raise RejectedError(Reason.MOVED_LATER)
        return gone


PART = Absent
