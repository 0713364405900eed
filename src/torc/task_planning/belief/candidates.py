"""Which objects the search considers removing."""

from collections.abc import Sequence

from torc.records import PlanningContext
from torc.task_planning.belief.costs import Ways
from torc.task_planning.belief.hiding import Belief
from torc.task_planning.belief.settings import SearchConfig

_WORTH = 0.01
"""Objects that are the target with a lower probability are not suspected."""


def suspects_of(context: PlanningContext) -> dict[int, float]:
    """How surely each object in sight is a target that perception has not recognised; sums to at most 1."""
    p = {k.id: k.target_p for k in context.scene.known if k.id in context.scene.ids and k.target_p >= _WORTH}
    total = max(sum(p.values()), 1.0)
    return {k: v / total for k, v in p.items()}


def may_have_been_seen(context: PlanningContext) -> bool:
    """Whether what was seen, and is still there, may be a target that perception has not recognised: it suspects an
    object, or did when it last saw it, or nothing tells it what the target looks like.
    """
    scene = context.scene
    # Ids are used again: one in sight is not that of what was brought.
    brought = {outcome.object_id for outcome in context.history if outcome.delivered} - {*scene.ids}
    p = [k.target_p for k in scene.known if k.id not in brought]
    return bool(p) and (max(p) == 0 or max(p) >= _WORTH)


def candidates_of(
    belief: Belief, suspects: dict[int, float], ways: dict[int, Ways], config: SearchConfig
) -> tuple[int, ...]:
    """The objects with most of the belief behind them, or that may be the target, and what stands in their way."""
    behind = belief.mass_behind()
    worth = {k: float(behind[k]) + suspects.get(k, 0.0) for k in ways}
    ranked = sorted((k for k in ways if worth[k] >= config.least_share), key=lambda k: (-worth[k], k))
    return with_obstacles(ranked, ways, config.candidates)


def with_obstacles(wanted: Sequence[int], ways: dict[int, Ways], most: int) -> tuple[int, ...]:
    """The wanted objects, up to a number, each followed by what lies on it or has to go before it can be grasped, and
    so on: first what blocks the grasps with the fewest blockers.
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
    """What lies on an object; if it has no grasp now, also what blocks its grasps."""
    found = [k for k in ways if way.on_it >> k & 1]
    if way.now:
        return found
    sets = zip(way.best.tolist(), way.blockers.tolist())
    for _, _, bits in sorted((b.bit_count(), -p, b) for p, b in sets if b):
        found += [k for k in ways if bits >> k & 1 and k not in found]
    return found
