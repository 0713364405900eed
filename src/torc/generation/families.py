"""Families of harder problems: the demands of each on a scene beyond the usual rules, or instead of them."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from torc.generation.arrangements import StructuredConfig
from torc.generation.config import Hiddenness, Reason
from torc.generation.inspection import Inspector, SceneView
from torc.generation.sampling import sample_models
from torc.problems.problem import Problem
from torc.problems.schema import Category
from torc.registry.kinds import SCENE_FAMILIES
from torc.registry.loading import make_part
from torc.sim.settling import StillnessConfig

HIDES = 0.15
"""Share of the target's pixels from which an object counts as hiding it."""


class SceneFamily:
    """The demands of a family on a scene. A subclass in `torc/parts/scene_families` overrides some of them.

    Attributes:
        category: of its scenes, if only one is possible.
        objects: number of objects of a scene, unless the user gives one.
        hidden: how hidden the target is, unless the configuration decides.
        unseen: not a single pixel of the target may be in sight.
        copied: the target is one of several copies of a model; else its model is unique in the scene.
        stuck: least number of objects hiding the target or before it that cannot be grasped at all; None: each object
            around it must be graspable (the paper's rule).
    """

    category: Category | None = None
    objects: str = "8-20"
    hidden: Hiddenness | None = None
    unseen: bool = False
    copied: bool = False
    stuck: int | None = None

    def sample(self, count: int, rng: np.random.Generator, models: Sequence[str]) -> list[str]:
        """Return the models of a scene, drawn from `models`."""
        return sample_models(count, rng, models=models)

    def arranged(self, usual: StructuredConfig) -> StructuredConfig:
        """Return how standing objects are arranged. By default no box lies so that it is too wide for the gripper."""
        return usual

    def unfit(self, view: SceneView, target: str, inspector: Inspector) -> Reason | None:
        """Return why an object cannot be the family's target, graspability aside; None if it can."""
        return None

    def finished(self, problem: Problem, inspector: Inspector, stillness: StillnessConfig) -> Problem:
        """Return the family's problem, from one with its target in place. Raises RejectedError."""
        return problem


@cache
def scene_family(name: str) -> SceneFamily:
    """Return the family of that name; "" means the usual problems. Raises UnknownNameError."""
    family: SceneFamily = make_part(SCENE_FAMILIES, name or "usual")
    return family


def hiders(view: SceneView, target: str, share: float = HIDES) -> tuple[str, ...]:
    """Return the objects visible where at least that share of the target would be, from the most pixels down."""
    names = [o.name for o in view.problem.ordered()]
    counts = view.visibility.hidden_by[names.index(target)]
    enough = share * max(int(view.visibility.pixels_alone[names.index(target)]), 1)
    return tuple(names[j] for j in np.argsort(-counts, kind="stable") if counts[j] >= enough)


def before(view: SceneView, target: str, inspector: Inspector) -> tuple[str, ...]:
    """Return the objects that hide a target, and those in front of it, each once."""
    around = inspector.around(view.problem, target)
    return tuple(dict.fromkeys((*hiders(view, target), *around.in_front)))
