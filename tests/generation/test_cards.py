"""Cards: everything within the picture, numbers on the objects to pick, and small files."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from torc.generation import cards
from torc.generation.cards import (
    CARD_WIDTH,
    HEADER,
    MARGIN,
    VIEW_SIZE,
    VIEWS_SIZE,
    Card,
    draw_card,
    jpeg_bytes,
)
from torc.generation.config import Hiddenness
from torc.generation.difficulty import Difficulty
from torc.generation.oracle_orders import OracleOrder
from torc.perception.palette import object_color
from torc.problems.problem import load_problem
from torc.records import TARGET_ID
from torc.sim.rendering import View

PROBLEM = load_problem("structured-04")
NAMES = [placement.name for placement in PROBLEM.ordered()]
DIFFICULTY = Difficulty(9, Hiddenness.HIDDEN, 0.0, 1, 3, 3)
ORDER = OracleOrder((NAMES[2], NAMES[0]), "2 picks, 0 drops; no order does with less.")
GRAY = 120


@pytest.fixture
def views(monkeypatch):
    """Views that take no time: grey, object 2 on the left, the target a spot on the right."""

    def fake(problem, config):
        labels = np.full((config.height, config.width), -1, np.int16)
        labels[100:300, 50:300] = 2
        labels[400:408, 700:708] = TARGET_ID
        rgb = np.full((*labels.shape, 3), GRAY, np.uint8)
        view = View(rgb, np.ones(labels.shape, np.float32), labels)
        return dict.fromkeys(cards.VIEW_TITLES, view)

    monkeypatch.setattr(cards, "problem_views", fake)


def _view(image, k):
    left = MARGIN + k % 2 * (VIEW_SIZE[0] + cards.GAP)
    top = HEADER + k // 2 * (VIEW_SIZE[1] + cards.GAP)
    return np.asarray(image)[top : top + VIEW_SIZE[1], left : left + VIEW_SIZE[0]]


def _rim_is_paper(image):
    pixels = np.asarray(image)
    rims = (pixels[:8], pixels[-4:], pixels[:, : MARGIN - 1], pixels[:, -MARGIN + 1 :])
    return all((rim == 255).all() for rim in rims)


def test_the_objects_to_pick_are_numbered_in_all_but_the_robots_view(views):
    image = draw_card(Card(PROBLEM, DIFFICULTY, ORDER))
    red = np.array(object_color(TARGET_ID))
    for k in range(4):
        body = _view(image, k)[30:]
        assert (body != GRAY).any() == (k > 0)
        if k > 0:
            # The first disc within its object; the target's beside the spot, which is smaller than a disc.
            assert (body[20:120, 25:150] != GRAY).any()
            assert (np.abs(body.astype(int) - red).sum(axis=2) < 30).any()


def test_without_an_answer_a_card_says_nothing_about_one(views):
    bare, full = (draw_card(Card(PROBLEM, DIFFICULTY, order)) for order in (None, ORDER))
    assert bare.size == (CARD_WIDTH, HEADER + VIEWS_SIZE[1] + MARGIN)
    assert full.height > bare.height
    assert all((_view(bare, k)[30:] == GRAY).all() for k in range(4))
    assert _rim_is_paper(bare)
    assert _rim_is_paper(full)


def test_nothing_is_cut_off_however_long_it_is(views):
    long = replace(
        PROBLEM,
        name="a" * 64,
        description="das sehr große Glas Erdbeermarmelade, das hinter dem Müsli steht, " * 9,
        objects=tuple(replace(o, name=f"{o.name}_{'x' * 40}") for o in PROBLEM.objects),
        target=f"{PROBLEM.target}_{'x' * 40}",
    )
    names = tuple(placement.name for placement in long.ordered())
    order = OracleOrder((*names[1:], *names[1:6], names[0]), "not proved best; " * 30)
    image = draw_card(Card(long, DIFFICULTY, order))
    assert _rim_is_paper(image)
    # Fourteen names of that length, three to a row at most.
    assert image.height > HEADER + VIEWS_SIZE[1] + 5 * 34


def test_numbers_are_those_of_the_first_pick():
    twice = OracleOrder((NAMES[4], "(nothing)", NAMES[4], NAMES[0]), "")
    assert Card(PROBLEM, DIFFICULTY, twice).numbers == {4: 1, 0: 4}
    assert Card(PROBLEM, DIFFICULTY).numbers == {}


def test_a_card_fits_into_the_bytes_wanted_if_it_can_be_read_then(rng):
    noise = Image.fromarray(rng.integers(0, 256, (200, 300, 3), np.uint8))
    free, tight = jpeg_bytes(noise, 10**6), jpeg_bytes(noise, 40_000)
    assert len(tight) <= 40_000 < len(free)
    assert Image.open(io.BytesIO(tight)).size == (300, 200)
    least = jpeg_bytes(noise, 1000)
    assert 1000 < len(least) < len(tight)
