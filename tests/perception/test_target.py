"""Which mask is the target: the likeliest, if it is likely enough, and none else."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.protocol import Wanted
from torc.perception.target import (
    TargetConfig,
    choose_target,
    held_probability,
    reference_mask,
    rivals,
    stretch,
    target_probabilities,
)
from torc.records import KnownObject

CONFIG = TargetConfig(likeness=0.75, steepness=20.0, pixels=0.3, sure=0.6, still=0.2, ahead=0.2)


def unit(*values):
    return (np.array(values) / np.linalg.norm(values)).astype(np.float32)


def test_the_nearest_reference_counts():
    references = np.stack([unit(1, 0, 0), unit(0, 1, 0)])
    looks = np.stack([unit(1, 0.1, 0), unit(0, 1, 0.1), unit(0, 0, 1), unit(1, 1, 0)])
    p = target_probabilities(looks, [1000] * 4, references, CONFIG)
    assert p[0] == pytest.approx(p[1])
    assert p[2] < p[3] < p[0]
    # At most one of them is the target, so that look-alikes share what there is.
    assert 0.95 < p[:2].sum() < p.sum() < 1
    assert target_probabilities(looks[:1], [1000], references, CONFIG)[0] > 0.95
    assert len(target_probabilities(looks[:0], [], references, CONFIG)) == 0


def test_what_may_have_been_brought_counts_like_one_more_object():
    references, looks = unit(1, 0)[None], np.stack([unit(1, 0.2), unit(1, 0.4)])
    both = target_probabilities(looks, [1000] * 2, references, CONFIG)
    odds = float(both[1] / (1 - both.sum()))
    alone = target_probabilities(looks[:1], [1000], references, CONFIG, brought_odds=odds)
    assert alone[0] == pytest.approx(both[0])


def test_a_half_is_where_the_fit_says_and_small_masks_say_less():
    cosine = CONFIG.likeness
    looks = unit(cosine, np.sqrt(1 - cosine**2))[None]
    reference = unit(1, 0)[None]
    p = [float(target_probabilities(looks, [n], reference, CONFIG)[0]) for n in (100, 1000, 4000)]
    assert p[1] == pytest.approx(0.5, abs=1e-5)
    assert p[0] < p[1] < p[2]


def test_none_is_an_answer():
    assert choose_target(np.array([]), None, CONFIG) is None
    assert choose_target(np.array([0.1, 0.5]), None, CONFIG) is None


def test_look_alikes_are_nobody_until_one_is_ahead():
    assert choose_target(np.array([0.9, 0.8]), None, CONFIG) is None
    assert choose_target(np.array([0.9, 0.5]), None, CONFIG) == 0


def test_the_one_it_was_stays_it_until_it_cannot_be_or_another_is_far_better():
    p = np.array([0.3, 0.5, 0.1])
    assert choose_target(p, 0, CONFIG) == 0
    assert choose_target(np.array([0.1, 0.5, 0.1]), 0, CONFIG) is None
    assert choose_target(np.array([0.1, 0.9, 0.1]), 0, CONFIG) == 1
    assert choose_target(np.array([0.7, 0.9, 0.1]), 0, CONFIG) == 1


def test_a_mask_comes_from_alpha_or_from_what_stands_out():
    rng = np.random.default_rng(0)
    picture = np.full((80, 100, 3), 200, np.uint8)
    picture[20:60, 30:70] = [180, 30, 40]
    picture = np.clip(picture + rng.normal(0, 4, picture.shape), 0, 255).astype(np.uint8)
    true = np.zeros((80, 100), bool)
    true[20:60, 30:70] = True
    found = reference_mask(picture)
    assert np.count_nonzero(found & true) / np.count_nonzero(found | true) > 0.9
    alpha = np.dstack([picture, 255 * true.astype(np.uint8)])
    assert (reference_mask(alpha) == true).all()
    opaque = np.dstack([picture, np.full(true.shape, 255, np.uint8)])
    assert (reference_mask(opaque) == found).all()
    assert reference_mask(np.full((40, 40, 3), 90, np.uint8)).all()


@pytest.mark.parametrize(
    "picture",
    [np.zeros((40, 40, 1), np.uint8), np.zeros((4, 40, 3), np.uint8), np.zeros((40, 40, 4), np.uint8)],
)
def test_a_picture_that_shows_nothing_is_refused(picture):
    with pytest.raises(InputError, match="reference picture"):
        reference_mask(picture)


def test_limits_are_checked():
    with pytest.raises(InputError, match="still"):
        TargetConfig(sure=0.3, still=0.5)


def test_in_the_hand_looks_count_and_so_does_what_was_believed():
    config = TargetConfig(held_likeness=0.7, held_steepness=20.0, held_trust=0.5)
    assert held_probability(0.7, 0.5, config) == pytest.approx(0.5)
    by_looks = [held_probability(c, 0.5, config) for c in (0.3, 0.65, 0.75, 1.0)]
    by_belief = [held_probability(0.7, p, config) for p in (0.0, 0.2, 0.8, 1.0)]
    for p in (by_looks, by_belief):
        assert p == sorted(p)
        assert 0 < p[0] < 0.5 < p[-1] < 1
    assert held_probability(0.7, 0.5, config, np.array([-1.0, -0.1])) == pytest.approx(0.5)
    by_size = [held_probability(0.7, 0.5, config, np.array(s)) for s in ((0.0, 0.2), (0.1, 0.1), (0.1, 0.0))]
    assert by_size[0] == pytest.approx(by_size[1])
    assert 0 < by_size[1] < by_size[2] < 0.5
    # A belief of nothing can be overcome, and one of certainty lost.
    assert held_probability(0.95, 0.0, config) > 0.5 > held_probability(0.45, 1.0, config)


def known(object_id, look, target_p):
    return KnownObject(object_id, np.zeros((1, 3), np.float32), look, 1.0, target_p=target_p)


def test_of_those_that_look_the_same_each_may_be_what_is_in_the_hand():
    alike = [known(i, unit(1, 0, 0), 0.24) for i in range(1, 5)]
    assert rivals(alike[:1], 1, CONFIG) == 0
    of_four = rivals(alike, 1, CONFIG)
    assert 2.7 < of_four < 3
    other = known(7, unit(0, 1, 0), 0.24)
    assert rivals([*alike, other], 1, CONFIG) == pytest.approx(of_four, abs=0.01)
    # What is surely not the target is no rival; nobody counts for more than one, however likely.
    assert rivals([alike[0], known(2, unit(1, 0, 0), 0.0)], 1, CONFIG) == 0
    assert rivals([known(1, unit(1, 0, 0), 0.1), known(2, unit(1, 0, 0), 0.9)], 1, CONFIG) < 1
    assert rivals([known(1, unit(1, 0, 0), 0.9), known(2, unit(1, 0, 0), 0.09)], 1, CONFIG) < 0.1
    # However well it looks, it is the target no more surely than one of so many.
    for cosine in (0.7, 0.9, 1.0):
        alone = held_probability(cosine, 0.6, CONFIG)
        assert held_probability(cosine, 0.6, CONFIG, rivals=3.0) == pytest.approx(1 / (1 / alone + 3))


def test_what_is_too_large_cannot_be_it_and_of_what_is_too_small_a_part_may_be_hidden():
    config = replace(CONFIG, too_long=5.0, too_thick=9.0)
    look, reference = unit(1, 0)[None], unit(1, 0)[None]

    def p(*seen_m, told_m=(0.1, 0.05)):
        stretched = None if told_m is None else stretch([seen_m], told_m)
        return float(target_probabilities(look, [1000], reference, config, stretched)[0])

    assert p(0.1, 0.1) < p(0.2, 0.05) < p(0.1, 0.05)
    assert p(0.1, 0.05) == p(0.06, 0.01) == p(0.2, 0.2, told_m=None) == pytest.approx(p(0.0, 0.0))


def test_a_size_that_is_none_is_refused():
    for size_m in ((0.0, 0.0), (0.1, -1.0), (18.0, 5.0), (0.1, 0.2), (float("nan"), 0.1)):
        with pytest.raises(InputError, match="in metres"):
            Wanted("", size_m=size_m)
