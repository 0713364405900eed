"""Families of harder problems: what each asks of a scene beyond the usual rules, or instead of them."""

from dataclasses import replace

import numpy as np

from torc.generation.config import Family, Reason, RejectedError
from torc.generation.inspection import Inspector, SceneView
from torc.objects.library import load_object
from torc.objects.names import SUFFIX, base_name
from torc.problems.problem import Problem
from torc.sim.settling import UNSEEN
from torc.sim.stillness import StillnessConfig, watch_stillness
from torc.sim.world import build_world

HIDES = 0.15
"""Share of the target's pixels from which an object counts as hiding it ..."""
COVERS = 0.05
"""... and as one of many that cover it."""

LARGE_ENOUGH_M = 0.05
"""Least width and height of the front of an object with a mark."""


def hiders(view: SceneView, target: str, share: float = HIDES) -> tuple[str, ...]:
    """The objects that show where such a share of the target would be seen, from the most pixels down."""
    names = [o.name for o in view.problem.ordered()]
    counts = view.visibility.hidden_by[names.index(target)]
    enough = share * max(int(view.visibility.pixels_alone[names.index(target)]), 1)
    return tuple(names[j] for j in np.argsort(-counts, kind="stable") if counts[j] >= enough)


def before(view: SceneView, target: str, inspector: Inspector) -> tuple[str, ...]:
    """The objects that hide a target, and those in front of it, each once."""
    around = inspector.around(view.problem, target)
    return tuple(dict.fromkeys((*hiders(view, target), *around.in_front)))


def with_copies(models: list[str], copies: int) -> list[str]:
    """The models of a scene, where one is the target with a mark, and as many others as wanted are copies without it.
    The first that is large enough for its mark to be seen is taken; none is changed where there are too few models.
    """
    fitting = [name for name in models if min(object_size(name)) >= LARGE_ENOUGH_M]
    if not copies or not fitting or len(models) < copies + 2:
        return models
    others = [name for name in models if name != fitting[0]]
    return [fitting[0] + SUFFIX, *[fitting[0]] * copies, *others[copies:]]


def object_size(model: str) -> tuple[float, float]:
    """Width and height of a model's front, metres."""
    _, width_m, height_m = load_object(model).size_m
    return width_m, height_m


def is_marked(view: SceneView, name: str) -> bool:
    """Whether an object has the mark."""
    return base_name(_model(view, name)) is not None


def copy_in_sight(view: SceneView, target: str) -> bool:
    """Whether at least half of some copy of a marked target is in sight: it could be taken for the target."""
    base = base_name(_model(view, target))
    return any(o.model == base and view.fraction(o.name) >= 0.5 for o in view.problem.objects)


def _model(view: SceneView, name: str) -> str:
    return next(o.model for o in view.problem.objects if o.name == name)


def finished(problem: Problem, family: Family, inspector: Inspector, stillness: StillnessConfig) -> Problem:
    """The problem of a family, from one with its target in place. Raises RejectedError if the scene without the target
    does not stay as it is: then the look would tell that it is gone.
    """
    if family not in (Family.ABSENT, Family.ABSENT_TWIN):
        return problem
    rest = tuple(o for o in problem.objects if o.name != problem.target)
    model = next(o.model for o in problem.objects if o.name == problem.target)
    gone = replace(problem, objects=rest, target_model=model)
    if not watch_stillness(build_world(gone, None, inspector.workspace, UNSEEN), stillness).still:
        raise RejectedError(Reason.MOVED_LATER)
    return gone if family is Family.ABSENT else problem
