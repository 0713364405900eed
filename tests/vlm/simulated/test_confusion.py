"""A model of a given quality errs as often as it is said to, and a better one only where a worse one does."""

from dataclasses import replace

import numpy as np
from situations import random_situation

from torc.vlm.simulated.confusion import ToldFacts, confused, draw_luck
from torc.vlm.simulated.profiles import PROFILES, Profile, profile_of_accuracy


def facts(situation):
    """All that a situation says, as a set."""
    kinds = {"lies": situation.lies_on, "hides": situation.hides, "blocks": situation.blocks}
    found = {(kind, pair) for kind, pairs in kinds.items() for pair in pairs}
    return found | {("grasp", k) for k in situation.graspable} | {("seen", situation.target_seen)}


def visible_part(situation):
    """What can be said of what is in sight, and of the target."""
    known = {*situation.in_sight, 0}

    def of(pairs):
        return frozenset(p for p in pairs if known >= {*p})

    hides = {p: n for p, n in situation.hides.items() if known >= {*p}}
    return replace(situation, lies_on=of(situation.lies_on), hides=hides, blocks=of(situation.blocks))


def test_the_perfect_one_takes_all_as_it_is(rng):
    for _ in range(50):
        truth = random_situation(rng)
        assert confused(truth, PROFILES["perfect"], draw_luck(rng)) == visible_part(truth)


def test_a_better_one_errs_only_where_a_worse_one_does(rng):
    """About facts that both can be asked: a model that does not see the target is asked what hides it, too."""
    for _ in range(50):
        truth, luck = random_situation(rng), draw_luck(rng)
        wrong = []
        for accuracy in (0.95, 0.8, 0.6, 0.3):
            profile = replace(profile_of_accuracy(accuracy, "some"), sees_target=1.0)
            believed = facts(confused(truth, profile, luck))
            mistakes = believed ^ facts(visible_part(truth))
            # The two directions in which one thing can be thought to lie on another are one mistake.
            wrong.append({(kind, frozenset(p) if kind == "lies" else p) for kind, p in mistakes})
        assert wrong[0] <= wrong[1] <= wrong[2] <= wrong[3]
        assert len(wrong[0]) < len(wrong[3])


def test_facts_are_right_as_often_as_stated(rng):
    profile = Profile(
        "some", 0.9, front=0.6, below=0.8, free=0.7, blocked=0.55, heeds_facts=0, made_up=0, malformed=0
    )
    right = {"seen": [], "front": [], "below": [], "free": [], "blocked": []}
    for _ in range(300):
        truth, luck = random_situation(rng), draw_luck(rng)
        believed = confused(truth, profile, luck)
        right["seen"].append(believed.target_seen == truth.target_seen)
        ids = truth.in_sight.keys() & believed.in_sight.keys()
        for k in ids:
            right["free" if k in truth.graspable else "blocked"].append(
                (k in believed.graspable) == (k in truth.graspable)
            )
        for a, b in ((a, b) for a, b in truth.near if a in ids and b in ids):
            right["blocked" if (a, b) in truth.blocks else "free"].append(
                ((a, b) in believed.blocks) == ((a, b) in truth.blocks)
            )
            right["front"].append(((a, b) in believed.hides) == ((a, b) in truth.hides))
            if not {(a, b), (b, a)} & truth.lies_on:
                right["below"].append(not {(a, b), (b, a)} & believed.lies_on)
    stated = {"seen": 0.9, "front": 0.6, "below": 0.8, "free": 0.7, "blocked": 0.55}
    for kind, found in right.items():
        spread = np.sqrt(stated[kind] * (1 - stated[kind]) / len(found))
        assert abs(np.mean(found) - stated[kind]) < 4 * spread, kind


def test_a_model_that_heeds_what_it_is_told_goes_by_it(rng):
    told = ToldFacts(frozenset({2, 3}), frozenset({(2, 5)}))
    for _ in range(50):
        truth = random_situation(rng)
        profile = replace(profile_of_accuracy(0.3, "some"), heeds_facts=1.0, sees_target=1.0)
        believed = confused(truth, profile, draw_luck(rng), told=told)
        assert believed.graspable == told.graspable & truth.in_sight.keys()
        assert {p for p in believed.blocks if p[1] in truth.in_sight} == told.blocks
        deaf = confused(
            truth, replace(profile, heeds_facts=0.0), draw_luck(np.random.default_rng(1)), told=told
        )
        assert deaf == confused(truth, profile, draw_luck(np.random.default_rng(1)))
