"""Which object follows from the facts."""

from dataclasses import replace
from itertools import pairwise

from situations import HIDDEN, random_situation


def test_what_hides_the_target_most_goes_first_but_before_it_what_lies_on_it():
    assert HIDDEN.removal_order() == (2, 1, 0)


def test_a_way_that_leads_nowhere_is_left_for_the_next():
    stuck = replace(HIDDEN, lies_on=frozenset(), graspable=frozenset({4}))
    assert stuck.waits_for(1) == ()  # nobody knows why it cannot be grasped
    assert stuck.removal_order() == (4, 3, 0)


def test_a_free_target_is_picked_at_once():
    seen = replace(HIDDEN, in_sight={0: 200, **HIDDEN.in_sight}, graspable=frozenset({0, 2, 4}))
    assert seen.removal_order() == (0,)
    covered = replace(seen, lies_on=frozenset({(4, 0)}))
    assert covered.removal_order() == (4, 0)


def test_orders_of_any_facts_keep_to_them(rng):
    """Whatever the facts: what is first can be picked, and each other object waits for the one before it."""
    ways = 0
    for _ in range(500):
        situation = random_situation(rng)
        order = situation.removal_order()
        assert len(set(order)) == len(order)
        if order:
            assert order[-1] == 0
        if len(order) > 1 and order[0] in situation.waits_for(order[1]):
            ways += 1
            assert order[0] in situation.graspable
            assert situation.waits_for(order[0]) == ()
            assert all(a in situation.waits_for(b) for a, b in pairwise(order))
        elif situation.graspable:
            assert order[0] in situation.graspable
    assert ways > 60
