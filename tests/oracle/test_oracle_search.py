"""The search finds what trying everything finds, whatever the rough plans promise, and keeps to its budget."""

import pytest
from oracle_spaces import TARGET, toy_spaces

from torc.oracle.promise import rough_plans
from torc.oracle.search import search
from torc.oracle.tree import Arrival, Cost, Fate, Options

MAX_PICKS = 5
PLENTY = 1e6


def solve(space, budget=PLENTY, max_picks=MAX_PICKS, tell=None, likely_suffices=False):
    return search(space, (), max_picks=max_picks, budget=budget, likely_suffices=likely_suffices, tell=tell)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"lying": 50},
        {"lying": 100},
        {"failing": 0, "dropping": 0, "losing": 0},
        {"failing": 45, "dropping": 50},
    ],
    ids=str,
)
def test_with_enough_budget_it_is_as_good_as_trying_everything(options):
    solvable = 0
    for space in toy_spaces(120, **options):
        found, best = solve(space), space.best(MAX_PICKS)
        assert found.proved
        assert (found.best and found.best.cost) == best == found.bound, space
        solvable += best is not None
    assert solvable > 60  # there is something to find


def test_the_sequence_found_leads_to_the_target_at_that_cost():
    for space in toy_spaces(100):
        found = solve(space)
        if found.best is None:
            continue
        state, drops = (), 0
        for choice, then in zip(found.best.choices, found.best.states[1:], strict=True):
            assert choice in space.look(state).choices
            arrival = space.pick(state, choice)
            state, drops = arrival.state, drops + arrival.dropped
            assert state == then
        assert arrival.fate is Fate.SOLVED
        assert found.best.cost == Cost(len(found.best.choices), drops)


@pytest.mark.parametrize("budget", [0.0, 0.25, 1.0, 2.0, 5.0, 12.0])
def test_a_budget_is_kept_and_what_is_said_then_is_true(budget):
    for space in toy_spaces(80, lying=20):
        found, best = solve(space, budget), space.best(MAX_PICKS)
        assert found.spent.total <= budget
        if found.best is not None:
            assert best <= found.best.cost
        if best is not None:
            assert found.bound <= best
        if found.proved:
            assert (found.best and found.best.cost) == best


def test_the_answer_only_gets_better_and_the_bound_tighter():
    for space in toy_spaces(100, lying=20):
        said = []
        final = solve(space, 40.0, tell=said.append)
        for before, after in zip(said, [*said[1:], final]):
            assert after.spent.total >= before.spent.total
            if before.best is not None:
                assert after.best.cost <= before.best.cost
            if after.bound is not None and before.bound is not None:
                assert before.bound <= after.bound
            assert after.bound is not None or after.best is None


def test_longer_sequences_than_allowed_do_not_count():
    for space in toy_spaces(100):
        for max_picks in (1, 2, 3):
            found = solve(space, max_picks=max_picks)
            assert (found.best and found.best.cost) == space.best(max_picks)
            if found.best is None and space.best(MAX_PICKS) is not None:
                assert found.limit == max_picks


def test_likely_is_said_where_every_shorter_rough_plan_was_tried():
    """Where picks only take away, what is likely is so; else it is so more often than not."""
    for space in toy_spaces(100, failing=0, dropping=0, losing=0):
        found = solve(space, 9.0, likely_suffices=True)
        if found.likely:
            assert found.best.cost == space.best(MAX_PICKS)
    told = [(f, s) for s in toy_spaces(200) if (f := solve(s, 9.0, likely_suffices=True)).likely]
    assert sum(f.best.cost == s.best(MAX_PICKS) for f, s in told) > 0.9 * len(told)
    assert any(not f.proved for f, _ in told)


class Lucky:
    """The target cannot be picked, but another pick brings it along."""

    def look(self, state):
        return Options((1, 2))

    def pick(self, state, choice):
        return Arrival((*state, choice), fate=Fate.SOLVED if choice == 2 else Fate.OPEN)

    def peek(self, state, removed):
        return Options((1, 2))


def test_luck_counts_where_it_is_met():
    found = solve(Lucky())
    assert found.best.choices == (2,)
    assert found.bound == Cost(1, 0)
    assert found.proved


class Hopeless(Lucky):
    """Nothing leads anywhere."""

    def pick(self, state, choice):
        return Arrival((*state, choice))


def test_where_nothing_leads_to_the_target_that_is_proved_or_the_best_beginning_is_told():
    found = solve(Hopeless(), max_picks=3)
    assert found.best is None
    assert found.bound is None
    assert found.proved
    found = solve(Hopeless(), budget=3.0)
    assert not found.proved
    assert found.bound == Cost(2, 0)


def test_rough_plans_come_in_order_of_length_one_per_set_and_lead_to_the_target():
    for space in toy_spaces(60, failing=0, dropping=0, losing=0):
        steps = list(rough_plans(lambda gone, space=space: space.peek((), gone), space.look(())))
        lengths = [picks for picks, _ in steps]
        assert lengths == sorted(lengths)
        plans = [plan for _, plan in steps if plan is not None]
        assert len({frozenset(plan) for plan in plans}) == len(plans)
        for plan in plans:
            assert plan[-1] == TARGET
            for i, k in enumerate(plan):
                assert k in space.look(plan[:i]).choices
