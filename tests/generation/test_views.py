"""The pictures show the clutter from four sides, the target outlined wherever it is."""

import numpy as np
import pytest

from torc.generation.views import VIEW_NAMES, ViewConfig, problem_views
from torc.perception.palette import object_color
from torc.problems.problem import load_problem
from torc.records import TARGET_ID

SIZE = ViewConfig(width=160, height=120)
RED = np.array(object_color(TARGET_ID), np.uint8)
NEAR = ("front", "side", "top")


@pytest.fixture(scope="module")
def hidden():
    return problem_views(load_problem("structured-04"), config=SIZE)


def _outline(view):
    return (view.rgb == RED).all(axis=2)


def test_four_views_of_the_size_asked_for(hidden):
    assert tuple(hidden) == VIEW_NAMES
    for view in hidden.values():
        assert view.rgb.shape == (120, 160, 3)
        assert view.label_image.shape == (120, 160)
        assert view.rgb.dtype == np.uint8
        assert view.rgb.std() > 10


def test_a_hidden_target_is_outlined_all_the_same(hidden):
    assert all(_outline(hidden[name]).sum() > 8 for name in NEAR)
    assert _outline(hidden["robot"]).sum() > 2
    assert TARGET_ID not in hidden["front"].label_image
    assert TARGET_ID in hidden["top"].label_image


def test_the_clutter_fills_the_near_views_and_none_of_it_is_cut_off(hidden):
    for name in NEAR:
        rows, cols = np.nonzero(hidden[name].label_image >= 0)
        # As far from both ends in one direction at least, and nowhere nearer to the rim than the margin.
        slack = min(np.ptp([rows.min(), 119 - rows.max()]), np.ptp([cols.min(), 159 - cols.max()]))
        assert slack <= 2
        margins = (rows.min() / 60, (119 - rows.max()) / 60, cols.min() / 80, (159 - cols.max()) / 80)
        assert 0.12 < min(margins) < 0.20
