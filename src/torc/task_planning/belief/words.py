"""Explain a decision of the planner `belief`: a sentence for people, and plain data for the log."""

from collections.abc import Callable, Sequence

import numpy as np

from torc.geometry.transforms import project
from torc.records import BeliefEvidence, Observation
from torc.task_planning.belief.hiding import Belief
from torc.task_planning.belief.target_plans import Access, Search

TILES = 60
"""Tiles of the belief's picture from top to bottom."""
_LEAST_TILE = 5e-5
_DIGITS = 4
Called = Callable[[int], str]


def search_reason(search: Search, called: Called) -> str:
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


def search_evidence(search: Search, observation: Observation) -> BeliefEvidence:
    """Return the belief of a search, rounded for the log."""
    belief = search.belief
    behind, hidden = belief.mass_behind(), belief.mass_hidden()
    tile_px, tiles = belief_tiles(belief, observation)
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


def belief_tiles(belief: Belief, observation: Observation) -> tuple[int, tuple[tuple[int, int, float], ...]]:
    """Return where in the image the target may be: a tile's edge in pixels, and each tile's (row, column, probability).

    Places that project outside the image are left out.
    """
    height, width = observation.depth_m.shape
    tile_px = max(1, height // TILES)
    cols, rows, depth = project(belief.poses[:, :3], observation.K, observation.T_world_camera)
    inside = (depth > 0) & (rows >= 0) & (rows < height) & (cols >= 0) & (cols < width)
    shape = -(-height // tile_px), -(-width // tile_px)
    shares = np.zeros(shape)
    row, col = (rows[inside] // tile_px).astype(int), (cols[inside] // tile_px).astype(int)
    np.add.at(shares, (row, col), belief.weights[inside])
    kept = np.argwhere(shares >= _LEAST_TILE)
    return tile_px, tuple((int(r), int(c), round(float(shares[r, c]), 5)) for r, c in kept)


def access_reason(access: Access, target: int, called: Called) -> str:
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


def access_evidence(access: Access) -> BeliefEvidence:
    """Return the removals that free a target in sight."""
    now = None if np.isinf(access.now) else _short(access.now)
    return BeliefEvidence(access.order, _short(access.picks), now)


def _short(value: float) -> float:
    return round(float(value), _DIGITS)


def _named(ids: Sequence[int], called: Called) -> str:
    names = [called(k) for k in ids]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
