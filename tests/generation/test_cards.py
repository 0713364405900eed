"""Cards: everything within the picture, numbers on the objects to pick, and small files."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from torc.generation import cards
from torc.generation.cards import CARD_WIDTH, HEADER, MARGIN, VIEW_SIZE, Card, draw_card, jpeg_bytes
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
    """Views that take no time: gray, object 2 on the left, the target a spot on the right."""

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


def test_the_objects_to_pick_are_numbered_in_all_but_the_robots_view(views):
    image = draw_card(Card(PROBLEM, DIFFICULTY, ORDER))
    bare = draw_card(Card(PROBLEM, DIFFICULTY))
    red = np.array(object_color(TARGET_ID))
    assert image.height > bare.height
    for k in range(4):
        assert (_view(bare, k)[30:] == GRAY).all()
        body = _view(image, k)[30:]
        assert (body != GRAY).any() == (k > 0)
        if k > 0:
            # The first disc within its object; the target's beside the spot, which is smaller than a disc.
            assert (body[20:120, 25:150] != GRAY).any()
            assert (np.abs(body.astype(int) - red).sum(axis=2) < 30).any()


def test_nothing_is_cut_off_however_long_it_is(views):
    long = replace(PROBLEM, name="a" * 64, description="das sehr große Glas hinter dem Müsli, " * 9)
    image = draw_card(
        Card(long, DIFFICULTY, OracleOrder((*NAMES[1:], *NAMES[1:], NAMES[0]), "not proved; " * 30))
    )
    pixels = np.asarray(image)
    assert image.width == CARD_WIDTH
    for rim in (pixels[:8], pixels[-4:], pixels[:, : MARGIN - 1], pixels[:, -MARGIN + 1 :]):
        assert (rim == 255).all()


def test_numbers_are_those_of_the_first_pick():
    twice = OracleOrder((NAMES[4], "(nothing)", NAMES[4], NAMES[0]), "")
    assert Card(PROBLEM, DIFFICULTY, twice).numbers == {4: 1, 0: 4}
    assert Card(PROBLEM, DIFFICULTY).numbers == {}


def test_a_card_fits_into_the_bytes_wanted(rng):
    noise = Image.fromarray(rng.integers(0, 256, (200, 300, 3), np.uint8))
    tight = jpeg_bytes(noise, 40_000)
    assert len(tight) <= 40_000 < len(jpeg_bytes(noise, 10**6))
    assert Image.open(io.BytesIO(tight)).size == (300, 200)
