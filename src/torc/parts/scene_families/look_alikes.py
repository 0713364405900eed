"""Copies of the target stand around it, without the mark that it has on one side."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from torc.generation.config import Reason
from torc.generation.families import SceneFamily
from torc.generation.inspection import Inspector, SceneView
from torc.objects.library import load_object
from torc.objects.names import SUFFIX, marked_description
from torc.problems.problem import Problem
from torc.sim.settling import StillnessConfig

COPIES = 3
LARGE_ENOUGH_M = 0.05
"""Least width and height of the front of an object with a mark."""


class LookAlikes(SceneFamily):
    """At least half of some copy must be in sight: it could be taken for the target."""

    copied = True

    def sample(self, count: int, rng: np.random.Generator, models: Sequence[str]) -> list[str]:
        """Return models among which are copies of one."""
        return with_copies(super().sample(count, rng, models), COPIES)

    def unfit(self, view: SceneView, target: str, inspector: Inspector) -> Reason | None:
        """Return whether a copy is in sight."""
        objects = view.problem.objects
        model = next(o.model for o in objects if o.name == target)
        copies = (o.name for o in objects if o.model == model and o.name != target)
        return None if any(view.fraction(name) >= 0.5 for name in copies) else Reason.NO_COPY_IN_SIGHT

    def finished(self, problem: Problem, inspector: Inspector, stillness: StillnessConfig) -> Problem:
        """Return the problem with a mark on its target, which changes nothing but what is seen."""
        target, objects = problem.target, problem.objects
        marked = tuple(replace(o, model=o.model + SUFFIX) if o.name == target else o for o in objects)
        return replace(problem, objects=marked, description=marked_description(problem.description))


def with_copies(models: list[str], copies: int) -> list[str]:
    """Return the models of a scene with that many of them replaced by copies of one, which may become the target.

    The first model that is large enough for a mark is copied; nothing changes where there are too few models.
    """
    fitting = [name for name in models if min(load_object(name).size_m[1:]) >= LARGE_ENOUGH_M]
    if not copies or not fitting or len(models) < copies + 2:
        return models
    others = [name for name in models if name != fitting[0]]
    return [fitting[0]] * (copies + 1) + others[copies:]


PART = LookAlikes
