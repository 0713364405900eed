"""Which object of a scene is the target: one that is hidden as wanted, hard to get, and as its family asks."""

from collections import Counter

import numpy as np

from torc.generation.config import GenerationConfig, Hiddenness, Reason
from torc.generation.families import before, scene_family
from torc.generation.inspection import Inspector, SceneView


def choose_target(
    view: SceneView, config: GenerationConfig, inspector: Inspector, rng: np.random.Generator
) -> tuple[str, Reason, tuple[str, ...]]:
    """An object that is hidden as wanted, not graspable at once, and retrievable as far as the paper's rule tells; ""
    if there is none, why, and the objects that no target can have around it."""
    scene, reason, family = view.problem, Reason.NONE_SO_HIDDEN, scene_family(config.family)
    ungraspable: dict[str, bool] = {}
    for name in _candidates(view, config, inspector, rng):
        bad = family.unfit(view, name, inspector)
        if bad is not None:
            reason = _further(reason, bad)
            continue
        if family.stuck is not None:
            found = _among_stuck(view, name, family.stuck, config, inspector)
            if found is None:
                return name, reason, ()
            reason = _further(reason, found)
            continue
        # What stands around the next candidate is mostly known from the last one: that question is the cheaper one.
        for other in (name, *inspector.around(scene, name).all):
            if other not in ungraspable:
                ungraspable[other] = not inspector.graspable_at_all(scene, other)
            if ungraspable[other]:
                reason = _further(reason, Reason.CANNOT_BE_GRASPED)
                break
        else:
            if not inspector.graspable_at_first(view, name, config.first_looks):
                return name, reason, ()
            reason = _further(reason, Reason.TRIVIAL)
    return "", reason, tuple(name for name, never in ungraspable.items() if never)


def _among_stuck(
    view: SceneView, name: str, wanted: int, config: GenerationConfig, inspector: Inspector
) -> Reason | None:
    """Why an object is no target behind things that cannot be grasped; None if it is one."""
    scene = view.problem
    stuck = (o for o in before(view, name, inspector) if not inspector.graspable_at_all(scene, o))
    if sum(1 for _ in stuck) < wanted:
        return Reason.NOTHING_STUCK
    if not inspector.graspable_at_all(scene, name):
        return Reason.CANNOT_BE_GRASPED
    return Reason.TRIVIAL if inspector.graspable_at_first(view, name, config.first_looks) else None


def _further(one: Reason, other: Reason) -> Reason:
    return max(one, other, key=list(Reason).index)


def _candidates(
    view: SceneView, config: GenerationConfig, inspector: Inspector, rng: np.random.Generator
) -> list[str]:
    """Objects that are hidden as wanted, in random order; where any will do, visible ones come last."""
    family = scene_family(config.family)
    models = Counter(o.model for o in view.problem.objects)
    # The target's description must be unique in the scene; one of several copies gets a mark.
    unique = [o.name for o in view.problem.objects if (models[o.model] > 1) == family.copied]
    groups = {name: inspector.hiddenness(view, name) for name in unique}
    shuffled = [unique[i] for i in rng.permutation(len(unique))]
    if family.unseen:
        shuffled = [name for name in shuffled if view.pixels(name) == 0]
    wanted = family.hidden or config.hidden
    if wanted == "any":
        return sorted(shuffled, key=lambda name: groups[name] is Hiddenness.VISIBLE)
    return [name for name in shuffled if groups[name].value == wanted]
