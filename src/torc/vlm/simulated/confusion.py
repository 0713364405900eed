"""From the truth to what a model of a given quality believes."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from torc.records import MAX_OBJECTS, TARGET_ID
from torc.vlm.simulated.profiles import Profile
from torc.vlm.simulated.situation import Pair, Situation


@dataclass(frozen=True)
class Luck:
    """All draws for one reply: uniform numbers in [0, 1) per object or pair, whatever the scene and the profile.

    A fact is right where its number is below the probability of being right on it, so the better of two accuracies is
    right wherever the worse one is.
    """

    target: float
    made_up: float
    malformed: float
    form: float
    grasp: Float[np.ndarray, "o"]
    facts: Float[np.ndarray, "o"]
    below: Float[np.ndarray, "o o"]
    direction: Float[np.ndarray, "o o"]
    front: Float[np.ndarray, "o o"]
    blocking: Float[np.ndarray, "o o"]
    extent: Float[np.ndarray, "o o"]


def draw_luck(rng: np.random.Generator) -> Luck:
    target, made_up, malformed, form = rng.random(4).tolist()
    grasp, facts = rng.random((2, MAX_OBJECTS))
    below, direction, front, blocking, extent = rng.random((5, MAX_OBJECTS, MAX_OBJECTS))
    return Luck(target, made_up, malformed, form, grasp, facts, below, direction, front, blocking, extent)


@dataclass(frozen=True)
class ToldFacts:
    """What a prompt says about grasps: graspable objects, and (blocker, blocked) pairs."""

    graspable: frozenset[int]
    blocks: frozenset[Pair]


def confused(
    truth: Situation,
    profile: Profile,
    luck: Luck,
    asked: Collection[Pair] = (),
    told: ToldFacts | None = None,
) -> Situation:
    """Return the situation as a model of that quality believes it to be.

    Args:
        truth: the situation.
        profile: the model's quality.
        luck: the draws for this reply.
        asked: pairs in the prompt's question; the model can err on them as on pairs that meet in the image.
        told: what the prompt says about grasps.
    """
    in_sight = dict(truth.in_sight)
    seen = truth.target_seen == (luck.target < profile.sees_target)
    if seen and not truth.target_seen:
        in_sight[TARGET_ID] = 0
    elif not seen:
        in_sight.pop(TARGET_ID, None)
    pairs = _pairs_in_question(truth, asked)
    hiding = pairs if seen else pairs | {(k, TARGET_ID) for k in truth.in_sight if k != TARGET_ID}
    believed = Situation(
        in_sight=in_sight,
        graspable=frozenset(k for k in in_sight if _free(k not in truth.graspable, luck.grasp[k], profile)),
        lies_on=_lies_on(truth, profile, luck, pairs),
        hides=_hides(truth, profile, luck, hiding),
        blocks=frozenset(p for p in pairs if not _free(p in truth.blocks, luck.blocking[p], profile)),
        near=truth.near,
    )
    return believed if told is None else _heeding(believed, told, profile, luck)


def _pairs_in_question(truth: Situation, asked: Collection[Pair]) -> frozenset[Pair]:
    """Return both directions of all pairs of objects in sight, or the target, on which the model can err."""
    known = {*truth.in_sight, TARGET_ID}
    pairs = {p for p in (*truth.near, *truth.lies_on, *truth.hides, *truth.blocks, *asked) if known >= {*p}}
    return frozenset({*pairs, *((b, a) for a, b in pairs)})


def _free(blocked: bool, luck: float, profile: Profile) -> bool:
    """True if something seems free: blocked but overlooked, or free and recognised."""
    return luck >= profile.blocked if blocked else luck < profile.free


def _lies_on(truth: Situation, profile: Profile, luck: Luck, pairs: frozenset[Pair]) -> frozenset[Pair]:
    """Return (upper, lower) as believed. A wrong direction counts as wrong."""
    found = set()
    for a, b in pairs:
        if a > b:
            continue
        upper = next((p for p in ((a, b), (b, a)) if p in truth.lies_on), None)
        if (upper is not None) != (luck.below[a, b] < profile.below):
            continue
        if upper is None:
            found.add((a, b) if luck.direction[a, b] < 0.5 else (b, a))
        else:
            found.add(upper if luck.direction[a, b] < profile.below else upper[::-1])
    return frozenset(found)


def _hides(truth: Situation, profile: Profile, luck: Luck, pairs: frozenset[Pair]) -> dict[Pair, int]:
    """Return (front, back) -> pixels as believed; a wrongly believed object hides a share of its own extent."""
    found = {}
    for pair in sorted(pairs):
        if (pair in truth.hides) == (luck.front[pair] < profile.front):
            share = luck.extent[pair] * truth.in_sight.get(pair[0], 0)
            found[pair] = truth.hides.get(pair, 1 + int(share))
    return found


def _heeding(believed: Situation, told: ToldFacts, profile: Profile, luck: Luck) -> Situation:
    """Return the situation with the prompt's facts on grasps of the objects for which the model heeds the prompt."""
    heeded = {k for k in believed.in_sight if luck.facts[k] < profile.heeds_facts}
    blocks = {p for p in believed.blocks if p[1] not in heeded} | {p for p in told.blocks if p[1] in heeded}
    graspable = (believed.graspable - heeded) | (told.graspable & heeded)
    return replace(believed, graspable=frozenset(graspable), blocks=frozenset(blocks))
