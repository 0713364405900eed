"""The arithmetic of the calibration: lost picks as a played episode loses them, and numbers found where they are."""

import numpy as np
import pytest

from benchmarks import vlm_calibration as calibration
from torc.vlm.simulated.situation import Situation

SITUATION = Situation(
    in_sight={0: 200, 1: 900, 2: 400},
    graspable=frozenset({2}),
    lies_on=frozenset({(2, 1)}),
    hides={(1, 0): 150},
    blocks=frozenset({(1, 0)}),
    near=frozenset({(0, 1), (1, 2), (0, 2)}),
)


def test_the_share_of_lost_picks_is_that_of_playing_on_until_none_is_lost(rng):
    p = np.array([0.9, 0.5, 0.2])
    lost = picks = 0
    for chance in np.tile(p, 3000):
        while not (rng.random(3) < chance).any():
            lost, picks = lost + 1, picks + 1
        picks += 1
    assert calibration.lost_share(p) == pytest.approx(lost / picks, abs=0.02)
    assert calibration.lost_share(np.zeros(2)) == pytest.approx(15 / 16)


def test_geometry_is_right_where_it_says_what_is_so():
    row = calibration.plain(SITUATION)
    true = [(0, "behind", 1), (1, "below", 2)]
    assert calibration.geometric_accuracy([{**row, "by_geometry": true}]) == (1.0, 1.0)
    # A pair turned round is wrong in both directions; of four directions of two pairs that is a half.
    turned = [(1, "behind", 0), (1, "below", 2)]
    assert calibration.geometric_accuracy([{**row, "by_geometry": turned}]) == (0.5, 1.0)
    missed = [(0, "behind", 1), (1, "behind", 2)]
    assert calibration.geometric_accuracy([{**row, "by_geometry": missed}]) == (1.0, pytest.approx(2 / 3))
