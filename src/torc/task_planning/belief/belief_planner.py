"""The planner `belief`: makes the removals that most cheaply reveal and free a target that may be in many places."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from torc.geometry.transforms import project
from torc.records import BeliefEvidence, Decision, Evidence, Observation, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.belief.costs import Ways, ways_of
from torc.task_planning.belief.hiding import Belief
from torc.task_planning.belief.settings import BeliefConfig
from torc.task_planning.belief.target_plans import (
    Access,
    Search,
    free_target,
    may_have_been_seen,
    search_target,
)
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.relations import find_relations

_TILES = 60
"""Tiles of the belief's picture from top to bottom."""
_LEAST_TILE = 5e-5
_DIGITS = 4
_Called = Callable[[int], str]


class BeliefPlanner(TaskPlannerTraits):
    """Keeps particles of where the target may be, and searches for the order of removals that reveals and frees it."""

    name = "belief"
    reads_picture = False

    def __init__(self, config: BeliefConfig | None = None) -> None:
        self.config = BeliefConfig() if config is None else config
        self._fallback = DgSelectPlanner(self.config.fallback)

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick, or None if no visible one is graspable; give up as `GiveUpConfig` says."""
        if not context.graspable_ids:
            return self._by_graph(context, rng, "nothing has a valid grasp")
        ways = ways_of(context, find_relations(context.scene, self.config.fallback.relations))
        if context.scene.target_id is not None:
            return self._take(context, ways, rng)
        return self._find(context, ways, rng)

    def warm_up(self, context: PlanningContext) -> None:
        """Run every compiled kernel once and discard the results."""
        self._fallback.warm_up(context)
        ways = ways_of(context, find_relations(context.scene, self.config.fallback.relations))
        search_target(context, ways, self.config, np.random.default_rng(0))

    def _take(self, context: PlanningContext, ways: dict[int, Ways], rng: np.random.Generator) -> Decision:
        access, target = free_target(context, ways, self.config), context.scene.target_number
        if not np.isfinite(access.picks):
            return self._by_graph(context, rng, "no removal is known to free the target")
        reason = _access_reason(access, target, context.called)
        rule = "clear the target" if access.order else "target"
        evidence = Evidence(rule, belief=_access_evidence(access))
        return Decision(access.order[0] if access.order else target, reason, evidence=evidence)

    def _find(self, context: PlanningContext, ways: dict[int, Ways], rng: np.random.Generator) -> Decision:
        search = search_target(context, ways, self.config, rng)
        belief = _search_evidence(search, context.scene.observation)
        if search.presence < self.config.give_up.below and not may_have_been_seen(context):
            reason = (
                f"Give up: the target is not in sight, and only over {search.room:.2%} of the support is there space "
                f"that could still hide it; that it is there has p = {search.presence:.3f}."
            )
            return Decision(None, reason, give_up=True, evidence=Evidence("give up", belief=belief))
        if search.belief.fitting < self.config.particles.fewest:
            return self._by_graph(context, rng, "too few places fit a hidden target", belief)
        if not search.order:
            return self._by_graph(context, rng, "no removal shows a place where the target may be", belief)
        reason = _search_reason(search, context.called)
        return Decision(search.order[0], reason, evidence=Evidence("search", belief=belief))

    def _by_graph(
        self,
        context: PlanningContext,
        rng: np.random.Generator,
        why: str,
        belief: BeliefEvidence | None = None,
    ) -> Decision:
        """Return DG-SELECT's choice, for when the belief says nothing."""
        decision = self._fallback.decide(context, rng)
        notes = {"by_graph_because": why}
        return replace(decision, evidence=replace(decision.evidence, belief=belief, notes=notes))


def _search_reason(search: Search, called: _Called) -> str:
    """Return the reason for a removal.

    E.g. "Pick 3: with it gone the target comes into sight with p = 0.41, and 0.62 of the places where it may be lie
    behind it. If it does not, 5 and 2 come next. About 2.4 picks to the target."
    """
    first, *later = search.order
    p, behind = search.reveals((first,)), float(search.belief.mass_behind()[first])
    said = f"Pick {called(first)}: "
    if search.suspects.get(first, 0.0) >= p / 2 > 0:
        said += f"it may be the target (p = {search.suspects[first]:.2f}), or show it: p = {p:.2f} in all."
    elif later and p < 0.5 * search.reveals((first, later[0])) - 0.05:
        both = search.reveals((first, later[0]))
        said += (
            f"it stands in the way of {called(later[0])}; once both are gone the target comes into sight with "
            f"p = {both:.2f}."
        )
    else:
        said += (
            f"with it gone the target comes into sight with p = {p:.2f}, and {behind:.2f} of the places where it may "
            "be lie behind it."
        )
    if later:
        comes = "comes" if len(later) == 1 else "come"
        said += f" If it does not, {_named(later, called)} {comes} next."
    return f"{said} About {search.expected_picks:.1f} picks to the target."


def _search_evidence(search: Search, observation: Observation) -> BeliefEvidence:
    """Return the belief of a search, rounded for the log."""
    belief = search.belief
    behind, hidden = belief.mass_behind(), belief.mass_hidden()
    tile_px, tiles = _belief_tiles(belief, observation)
    return BeliefEvidence(
        order=search.order,
        expected_picks=_short(search.expected_picks),
        reveals={k: _short(search.reveals((k,))) for k in search.candidates},
        behind={k: _short(behind[k]) for k in search.candidates},
        hidden_by={k: _short(hidden[k]) for k in search.candidates},
        prices={k: _short(v) for k, v in zip(search.candidates, search.plan.each) if np.isfinite(v)},
        beyond=_short(search.places.beyond),
        particles=belief.fitting,
        presence=_short(search.presence),
        suspects={k: _short(p) for k, p in search.suspects.items()},
        tile_px=tile_px,
        tiles=tiles,
    )


def _belief_tiles(belief: Belief, observation: Observation) -> tuple[int, tuple[tuple[int, int, float], ...]]:
    """Return where in the image the target may be: a tile's edge in pixels, and each tile's (row, column, probability).

    Places that project outside the image are left out.
    """
    height, width = observation.depth_m.shape
    tile_px = max(1, height // _TILES)
    cols, rows, depth = project(belief.poses[:, :3], observation.K, observation.T_world_camera)
    inside = (depth > 0) & (rows >= 0) & (rows < height) & (cols >= 0) & (cols < width)
    shape = -(-height // tile_px), -(-width // tile_px)
    shares = np.zeros(shape)
    row, col = (rows[inside] // tile_px).astype(int), (cols[inside] // tile_px).astype(int)
    np.add.at(shares, (row, col), belief.weights[inside])
    kept = np.argwhere(shares >= _LEAST_TILE)
    return tile_px, tuple((int(r), int(c), round(float(shares[r, c]), 5)) for r, c in kept)


def _access_reason(access: Access, target: int, called: _Called) -> str:
    """Return why the target is taken, or what makes way for it."""
    if not access.order:
        return (
            f"Pick {called(target)}: it is the target, it has a valid grasp, and removing something first would not "
            f"save a pick ({access.now:.1f} to be expected)."
        )
    first = access.order[0]
    gone = f"{_named(access.order, called)} {'is' if len(access.order) == 1 else 'are'} gone"
    if not access.frees:
        later = f", then {_named(access.order[1:], called)}" if len(access.order) > 1 else ""
        return f"Pick {called(first)}{later}: that makes way for the target {called(target)}, which is still blocked."
    better = "can be taken" if np.isinf(access.now) else f"is better taken than now ({access.now:.1f} picks)"
    return f"Pick {called(first)}: once {gone} the target {called(target)} {better}. About {access.picks:.1f} picks."


def _access_evidence(access: Access) -> BeliefEvidence:
    """Return the removals that free a target in sight."""
    now = None if np.isinf(access.now) else _short(access.now)
    return BeliefEvidence(access.order, _short(access.picks), now)


def _short(value: float) -> float:
    return round(float(value), _DIGITS)


def _named(ids: Sequence[int], called: _Called) -> str:
    names = [called(k) for k in ids]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
