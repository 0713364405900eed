"""`torc problems gallery` as a user meets it."""

import json
from functools import partial

import pytest
from PIL import Image

from tests.helpers.torc_command import run_torc
from torc.generation import gallery
from torc.generation.config import Hiddenness
from torc.generation.inspection import Difficulty
from torc.problems.problem import load_problem, save_problem

_torc = partial(run_torc, "problems", "gallery")


@pytest.fixture
def drawn(monkeypatch):
    """Cards that take no time; they are kept."""
    cards = []

    def draw(card):
        cards.append(card)
        return Image.new("RGB", (100, 80))

    monkeypatch.setattr(gallery, "draw_card", draw)
    monkeypatch.setattr(
        gallery, "difficulty_of", lambda problem, inspector: Difficulty(9, Hiddenness.HIDDEN, 0.0, 1, 3, 3)
    )
    return cards


def test_a_directory_of_problems_with_a_title(drawn, tmp_path, capsys):
    mine, out = tmp_path / "mine", tmp_path / "g"
    mine.mkdir()
    save_problem(load_problem("structured-04"), mine / "a.yaml")
    code, text, _ = _torc(mine, "--out", out, "--title", "Mine", "--json", capsys=capsys)
    assert code == 0
    (card,) = json.loads(text)
    assert (card["problem"], card["hiddenness"], card["order"]) == ("structured-04", "hidden", None)
    assert "# Mine" in (out / "gallery.md").read_text()
