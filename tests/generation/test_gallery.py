"""Cards number the objects to pick; the pages of a gallery show every card and need nothing from elsewhere."""

import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from torc.drawing.palette import object_color
from torc.errors import InputError
from torc.generation import cards, gallery
from torc.generation.cards import DRAWN_SIZE, GAP, VIEW_NAMES, VIEW_SIZE, Card, draw_card
from torc.generation.config import Hiddenness
from torc.generation.gallery import make_gallery
from torc.generation.inspection import Difficulty
from torc.oracle.answer import OracleOrder
from torc.problems.problem import load_problem
from torc.records import TARGET_ID
from torc.sim.rendering import View

A, B = load_problem("structured-04"), load_problem("unstructured-03")
HIDDEN = Difficulty(9, Hiddenness.HIDDEN, 0.0, 1, 3, 3)
PARTLY = Difficulty(14, Hiddenness.PARTLY, 0.13, 5, 5, 8)
ORDER = OracleOrder(("juice_carton_orange", "lime_green"), "2 picks, 0 drops; no order does with less.")


@pytest.fixture
def make(monkeypatch, tmp_path):
    """Galleries whose cards take no time."""
    monkeypatch.setattr(gallery, "draw_card", lambda card: Image.new("RGB", (1000, 858)))

    def made(*problems, orders=None, title="A set", out=tmp_path):
        stated = [replace(p, origin={**p.origin, **d.facts()}) for p, d in zip(problems, (HIDDEN, PARTLY))]
        told = []
        cards = make_gallery(title, stated, lambda _: None, out, orders or {}, told.append)
        assert told == stated
        assert [card.problem for card in cards] == stated
        return tmp_path

    return made


def test_the_html_page_shows_and_filters_every_card(make):
    text = (make(A, B, orders={A.name: ORDER}) / "index.html").read_text()
    for problem, group in ((A, "hidden"), (B, "partly")):
        assert f'id="{problem.name}" data-category="{problem.category}" data-hiddenness="{group}"' in text
        assert f'<img src="cards/{problem.name}.jpg"' in text
    options = re.findall(r'<option value="(\w*)">', text)
    assert options == ["", "structured", "unstructured", "", "partly", "hidden"]
    assert "no order does with less. 1 juice_carton_orange, 2 lime_green" in text
    assert "$" not in text


def test_the_markdown_page_has_a_row_and_a_card_for_each(make):
    text = (make(B, A, orders={A.name: ORDER}) / "gallery.md").read_text()
    assert f"| [{A.name}](#{A.name}) | the lime | 9 | 13 % | 2 picks |" in text
    row = rf"\| \[{B.name}\]\(#{B.name}\) \| {B.description} \| {len(B.objects)} \| \d+ % \|  \|"
    assert re.search(row, text)
    headings = re.findall(r"^#+ .*", text, re.MULTILINE)
    assert headings == ["# A set", "## Unstructured", f"### {B.name}", "## Structured", f"### {A.name}"]
    assert "1 juice_carton_orange, 2 lime_green\n\n![structured-04](cards/structured-04.jpg)" in text


def test_words_from_strangers_do_no_harm(make):
    wild = replace(A, description='<script>alert("x")</script> | a [b](c) *d* ${title} & \\')
    out = make(wild, title="<b>&")
    page = (out / "index.html").read_text()
    assert page.count("<script>") == 1
    assert "<b>" not in page
    text = (out / "gallery.md").read_text()
    assert "<" not in text.replace("\\<", "")
    (row,) = [line for line in text.splitlines() if line.startswith("| [")]
    assert len(re.findall(r"(?<!\\)\|", row)) == 6


def test_two_problems_of_one_name_are_refused(make, tmp_path):
    with pytest.raises(InputError, match="same name: structured-04"):
        make_gallery("", [A, B, A], lambda _: None, tmp_path / "g", {})
    assert not (tmp_path / "g").exists()


NAMES = [placement.name for placement in A.ordered()]
SECOND = OracleOrder((NAMES[2], NAMES[0]), "2 picks, 0 drops; no order does with less.")
GRAY = 120


@pytest.fixture
def views(monkeypatch):
    """Views that take no time: gray, object 2 on the left, the target a spot on the right."""

    def fake(problem):
        labels = np.full(DRAWN_SIZE[::-1], -1, np.int16)
        labels[100:300, 50:300] = 2
        labels[400:408, 700:708] = TARGET_ID
        rgb = np.full((*labels.shape, 3), GRAY, np.uint8)
        view = View(rgb, np.ones(labels.shape, np.float32), labels)
        return dict.fromkeys(VIEW_NAMES, view)

    monkeypatch.setattr(cards, "problem_views", fake)


def _view(image, k):
    left, top = k % 2 * (VIEW_SIZE[0] + GAP), k // 2 * (VIEW_SIZE[1] + GAP)
    return np.asarray(image)[top : top + VIEW_SIZE[1], left : left + VIEW_SIZE[0]]


def test_the_objects_to_pick_are_numbered_in_all_but_the_robots_view(views):
    image, bare = draw_card(Card(A, HIDDEN, SECOND)), draw_card(Card(A, HIDDEN))
    red = np.array(object_color(TARGET_ID))
    for k in range(4):
        assert (_view(bare, k)[30:] == GRAY).all()
        body = _view(image, k)[30:]
        assert (body != GRAY).any() == (k > 0)
        if k > 0:
            # The first disc within its object; the target's beside the spot, which is smaller than a disc.
            assert (body[20:120, 25:150] != GRAY).any()
            assert (np.abs(body.astype(int) - red).sum(axis=2) < 30).any()
