"""The pages of a gallery show every card, say what is on it, and need nothing from elsewhere."""

import re
from dataclasses import replace

import pytest
from PIL import Image

from torc.errors import InputError
from torc.generation import gallery
from torc.generation.config import Hiddenness
from torc.generation.difficulty import Difficulty
from torc.generation.gallery import make_gallery
from torc.generation.oracle_orders import OracleOrder
from torc.problems.problem import load_problem

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
        cards = make_gallery(title, stated, None, out, orders or {}, told.append)
        assert told == stated
        assert [card.problem for card in cards] == stated
        return tmp_path

    return made


def test_the_html_page_shows_and_filters_every_card(make):
    text = (make(A, B, orders={A.name: ORDER}) / "index.html").read_text()
    for problem, group in ((A, "hidden"), (B, "partly")):
        assert f'id="{problem.name}" data-category="{problem.category}" data-hiddenness="{group}"' in text
        assert f'<img src="cards/{problem.name}.jpg"' in text
    assert re.findall(r'<option value="(\w*)">', text) == [
        "",
        "structured",
        "unstructured",
        "",
        "partly",
        "hidden",
    ]
    assert "ORACLE: juice_carton_orange, lime_green" in text
    assert "$" not in text


def test_the_markdown_page_has_a_row_and_a_card_for_each(make):
    text = (make(B, A, orders={A.name: ORDER}) / "gallery.md").read_text()
    assert f"| [{A.name}](#{A.name}) | the lime | 9 | 13 % | 2 picks |" in text
    row = rf"\| \[{B.name}\]\(#{B.name}\) \| {B.description} \| {len(B.objects)} \| \d+ % \|  \|"
    assert re.search(row, text)
    headings = re.findall(r"^#+ .*", text, re.MULTILINE)
    assert headings == ["# A set", "## Unstructured", f"### {B.name}", "## Structured", f"### {A.name}"]
    assert "ORACLE: juice\\_carton" not in text
    assert "ORACLE: juice_carton_orange, lime_green](cards/structured-04.jpg)" in text


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
        make_gallery("", [A, B, A], None, tmp_path / "g", {})
    assert not (tmp_path / "g").exists()
