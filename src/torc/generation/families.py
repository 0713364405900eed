"""Families of harder problems: what each asks of a scene beyond the usual rules, or instead of them."""

from dataclasses import replace

import numpy as np

from torc.generation.clutter import without
from torc.generation.config import Family, FamilyRules, Reason, RejectedError
from torc.generation.inspection import Inspector, SceneView
from torc.generation.shelves import sort_of
from torc.objects.library import load_object
from torc.objects.names import SUFFIX, marked_description
from torc.problems.problem import Problem
from torc.sim.settling import COARSE, UNSEEN
from torc.sim.simulated_world import build_world
from torc.sim.stillness import StillnessConfig, watch_stillness

HIDES = 0.15
"""Share of the target's pixels from which an object counts as hiding it ..."""
COVERS = 0.05
"""... and as one of many that cover it."""

LARGE_ENOUGH_M = 0.05
"""Least width and height of the front of an object with a mark."""
FALLS = StillnessConfig(distance_m=0.02, angle_rad=float(np.deg2rad(15)), seconds=1.5)
"""What moves further than this once something is gone was held up by it."""


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
    """The models of a scene, where as many others as wanted are copies of one, any of which may become the target. The
    first that is large enough for a mark to be seen is taken; none is changed where there are too few models.
    """
    fitting = [name for name in models if min(load_object(name).size_m[1:]) >= LARGE_ENOUGH_M]
    if not copies or not fitting or len(models) < copies + 2:
        return models
    others = [name for name in models if name != fitting[0]]
    return [fitting[0]] * (copies + 1) + others[copies:]


def unfit(view: SceneView, target: str, rules: FamilyRules, inspector: Inspector) -> Reason | None:
    """Why an object is no target of a family, whatever can be grasped; None if it may be one."""
    if len(hiders(view, target, COVERS)) < rules.covered:
        return Reason.NOT_COVERED
    if rules.copies and not copy_in_sight(view, target):
        return Reason.NO_COPY_IN_SIGHT
    if rules.sorted and not among_its_sort(view, target):
        return Reason.NOT_AMONG_ITS_SORT
    if rules.held_up:
        holding = sum(holds_up(view.problem, o, inspector) for o in before(view, target, inspector))
        return Reason.NOTHING_HELD_UP if holding < rules.held_up else None
    return None


def holds_up(problem: Problem, name: str, inspector: Inspector) -> bool:
    """Whether something falls if an object vanishes."""
    world = build_world(without(problem, (name,)), None, inspector.workspace, COARSE)
    return not watch_stillness(world, FALLS).still


def among_its_sort(view: SceneView, target: str) -> bool:
    """Whether the object that hides the largest part of a target is of its sort."""
    models = {o.name: o.model for o in view.problem.objects}
    in_the_way = hiders(view, target)
    return bool(in_the_way) and sort_of(models[in_the_way[0]]) == sort_of(models[target])


def copy_in_sight(view: SceneView, target: str) -> bool:
    """Whether at least half of some copy of a target is in sight: it could be taken for the target."""
    model = next(o.model for o in view.problem.objects if o.name == target)
    return any(
        o.model == model and o.name != target and view.fraction(o.name) >= 0.5 for o in view.problem.objects
    )


def finished(problem: Problem, family: Family, inspector: Inspector, stillness: StillnessConfig) -> Problem:
    """The problem of a family, from one with its target in place. Raises RejectedError if the scene without the target
    does not stay as it is: then the look would tell that it is gone.
    """
    if family is Family.LOOK_ALIKES:
        # The mark changes nothing but what is seen.
        marked = tuple(
            replace(o, model=o.model + SUFFIX) if o.name == problem.target else o for o in problem.objects
        )
        return replace(problem, objects=marked, description=marked_description(problem.description))
    if family not in (Family.ABSENT, Family.ABSENT_TWIN):
        return problem
    rest = tuple(o for o in problem.objects if o.name != problem.target)
    model = next(o.model for o in problem.objects if o.name == problem.target)
    gone = replace(problem, objects=rest, target_model=model)
    if not watch_stillness(build_world(gone, None, inspector.workspace, UNSEEN), stillness).still:
        raise RejectedError(Reason.MOVED_LATER)
    return gone if family is Family.ABSENT else problem
