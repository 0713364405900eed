"""Choose the objects whose removal the search considers."""

from collections.abc import Sequence

from torc.records import PlanningContext
from torc.task_planning.belief.costs import Ways
from torc.task_planning.belief.hiding import Belief
from torc.task_planning.belief.settings import SearchConfig

_WORTH = 0.01
"""Objects less likely than this to be the target are not suspected."""


def suspects_of(context: PlanningContext) -> dict[int, float]:
    """Return the probability that each object in sight is the unrecognised target; they sum to at most 1."""
    p = {k.id: k.target_p for k in context.scene.known if k.id in context.scene.ids and k.target_p >= _WORTH}
    total = max(sum(p.values()), 1.0)
    return {k: v / total for k, v in p.items()}


def may_have_been_seen(context: PlanningContext) -> bool:
    """Check whether the target may have been seen without being recognised, and still be there.

    True if perception suspects an object, did so when it last saw it, or does not know what the target looks like.
    """
    scene = context.scene
    # Ids are reused: an object in sight is not the one that was delivered under its id.
    brought = {outcome.object_id for outcome in context.history if outcome.delivered} - {*scene.ids}
    p = [k.target_p for k in scene.known if k.id not in brought]
    return bool(p) and (max(p) == 0 or max(p) >= _WORTH)


def candidates_of(
    belief: Belief, suspects: dict[int, float], ways: dict[int, Ways], config: SearchConfig
) -> tuple[int, ...]:
    """Return objects with most of the belief behind them, or that may be the target, and what blocks them."""
    behind = belief.mass_behind()
    worth = {k: float(behind[k]) + suspects.get(k, 0.0) for k in ways}
    ranked = sorted((k for k in ways if worth[k] >= config.least_share), key=lambda k: (-worth[k], k))
    return with_obstacles(ranked, ways, config.candidates)


def with_obstacles(wanted: Sequence[int], ways: dict[int, Ways], most: int) -> tuple[int, ...]:
    """Return up to `most` objects: each wanted one, followed by what lies on it or must go before it can be grasped.

    This is applied recursively. Blockers of the grasps with the fewest blockers come first.
    """
    chosen: list[int] = []
    waiting = list(reversed(wanted))
    while waiting and len(chosen) < most:
        k = waiting.pop()
        if k in chosen or k not in ways:
            continue
        chosen.append(k)
        waiting += reversed(_obstacles(ways[k], ways))
    return tuple(chosen)


def _obstacles(way: Ways, ways: dict[int, Ways]) -> list[int]:
    """Return what lies on an object and, if it has no grasp now, what blocks its grasps."""
    found = [k for k in ways if way.on_it >> k & 1]
    if way.now:
        return found
    sets = zip(way.best.tolist(), way.blockers.tolist())
    for _, _, bits in sorted((b.bit_count(), -p, b) for p, b in sets if b):
        found += [k for k in ways if bits >> k & 1 and k not in found]
    return found
