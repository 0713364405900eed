"""What a search for values is told of looks, with draws made up."""

from types import SimpleNamespace

import pytest

from torc.records import TARGET_ID
from torc_next_object.making import looks as looks_module
from torc_next_object.making.looks import DRAWS, FURTHER_DRAWS, Looks
from torc_next_object.making.pricing import NEVER, price_of


class Context(dict):
    """p(hold) by object."""

    @property
    def scene(self):
        return SimpleNamespace(ids=tuple(self))


class Draws:
    """A sandbox whose looks say what each object's p(hold) is, by seed and by what is gone."""

    def __init__(self, hold):
        self.hold, self.asked = hold, []

    def begin(self):
        return "start"

    def looks_without(self, start, gone, seeds):
        for seed in seeds:
            self.asked.append((seed, gone))
            holds = {k: p for k, p in self.hold(seed, gone).items() if k not in gone}
            yield SimpleNamespace(context=Context(holds))


@pytest.fixture(autouse=True)
def plain_contexts(monkeypatch):
    monkeypatch.setattr(
        looks_module, "options_of", lambda holds: SimpleNamespace(choices=tuple(holds), outlook=1.0)
    )
    monkeypatch.setattr(looks_module, "best_hold", lambda holds, k: holds.get(k, 0.0))


def test_what_is_sure_in_all_draws_is_not_drawn_again():
    draws = Draws(lambda seed, gone: {3: 0.9, 5: 0.875 + seed / 32})
    looks = Looks(draws)
    seen = looks.seen(frozenset())
    assert draws.asked == [(seed, frozenset()) for seed in range(1, 1 + DRAWS)]
    assert seen.prices == {3: price_of([0.9] * 2, 15), 5: price_of([0.90625, 0.9375], 15)}
    looks.seen(frozenset())
    assert len(draws.asked) == DRAWS


def test_lucky_draws_do_not_count_for_what_is_in_doubt():
    """Only the first two draws have a good grasp of the target, and of object 7."""
    draws = Draws(lambda seed, gone: {TARGET_ID: 0.9 if seed <= DRAWS else 0.3, 7: 0.9 if seed == 1 else 0.0})
    seen = Looks(draws).seen(frozenset({4}))
    assert len(draws.asked) == DRAWS + FURTHER_DRAWS
    assert seen.target == price_of([0.3] * FURTHER_DRAWS, 14, True)
    # The one look in which it had a grasp is not one of those that settle it.
    assert 7 not in seen.others


def test_a_poor_grasp_is_in_doubt_even_where_draws_agree():
    draws = Draws(lambda seed, gone: {3: 0.3 if seed <= DRAWS else 0.1})
    assert Looks(draws).seen(frozenset()).others == {3: price_of([0.1] * FURTHER_DRAWS, 15)}


def test_what_looks_the_same_in_the_first_draws_is_settled_once():
    draws = Draws(lambda seed, gone: {TARGET_ID: 0.5, 1: 1.0, 2: 1.0} if 9 in gone or 8 in gone else {1: 1.0})
    looks = Looks(draws)
    prices = [looks.seen(frozenset(gone)).target for gone in ((9,), (8,), (9, 1), ())]
    assert prices == [price_of([0.5] * 8, 14, True)] * 2 + [price_of([0.5] * 8, 13, True), None]
    assert len(draws.asked) == 4 * DRAWS + FURTHER_DRAWS


def test_what_no_first_draw_can_grasp_is_looked_at_again_once_for_all_objects():
    draws = Draws(lambda seed, gone: {4: 1.0} if seed <= DRAWS else {4: 1.0, 7: 0.5})
    looks = Looks(draws)
    assert looks.seen(frozenset()).others.keys() == {4}
    assert looks.price(frozenset(), 7) == price_of([0.5] * FURTHER_DRAWS, 15)
    assert looks.price(frozenset(), 8) == NEVER
    assert len(draws.asked) == DRAWS + FURTHER_DRAWS
