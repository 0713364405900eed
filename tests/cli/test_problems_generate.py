"""`torc problems generate` and `validate` as a user meets them: files, words, exit codes."""

import json
from collections import Counter
from dataclasses import replace
from functools import partial

import pytest
from torc_command import run_torc

from torc.generation import batch, generator, validation
from torc.generation.config import Hiddenness
from torc.generation.difficulty import Difficulty
from torc.generation.generator import GeneratedProblem, NotGenerated
from torc.generation.rejections import Reason
from torc.generation.validation import Check, ValidationReport
from torc.objects.files import save_object
from torc.objects.library import load_object
from torc.problems.problem import load_problem, save_problem

SHIPPED = load_problem("structured-04")
DIFFICULTY = Difficulty(9, Hiddenness.PARTLY, 0.31, 2, 3, 4)


_torc = partial(run_torc, "problems")


@pytest.fixture
def jobs(monkeypatch):
    """Generation that takes no time: odd seeds fail."""
    seen = []

    def fake(config, seed, inspector, progress):
        seen.append((config, seed))
        progress(1, Reason.TRIVIAL)
        if seed % 2:
            return NotGenerated(config.attempts, {Reason.TRIVIAL: config.attempts})
        made = replace(SHIPPED, name=f"p{seed}", origin={"made from": str((config, seed))})
        return GeneratedProblem(made, DIFFICULTY, 2, {Reason.TRIVIAL: 1})

    def same(problem, config, seed, robot):
        return problem.origin.get("made from") == str((config, seed))

    monkeypatch.setattr(batch, "generate_problem", fake)
    monkeypatch.setattr(generator, "is_made_from", same)
    return seen


def test_problems_are_written_and_summed_up(jobs, tmp_path, capsys):
    out = tmp_path / "mine"
    code, text, err = _torc(
        "generate", "--structured", "--seed", 4, "--objects", "9", "--out", out, capsys=capsys
    )
    assert code == 0
    assert load_problem(out / "structured-s0004.yaml").objects == SHIPPED.objects
    assert "1 of 1 made, 2 scenes tried" in text
    assert Reason.TRIVIAL.value in text
    assert "31 % in sight (partly)" in text
    assert "scene 1" in err
    config, seed = jobs[0]
    assert (config.category, config.objects, seed) == ("structured", (9, 9), 4)


def test_without_a_category_both_come_in_turn(jobs, tmp_path, capsys):
    code, out, _ = _torc("generate", "--count", 4, "--seed", 0, "--out", tmp_path, "--json", capsys=capsys)
    facts = json.loads(out)
    assert code == 1
    assert [config.category for config, _ in jobs] == ["structured", "unstructured"] * 2
    assert [made["seed"] for made in facts["made"]] == [0, 2]
    assert [failed["seed"] for failed in facts["failed"]] == [1, 3]
    assert facts["rejections"] == {Reason.TRIVIAL.value: 122}
    assert not (tmp_path / "unstructured-s0001.yaml").exists()
    # A seed is of the same category wherever a call begins.
    _torc("generate", "--seed", 3, "--out", tmp_path / "3", capsys=capsys)
    assert (jobs[4][0].category, jobs[4][1]) == ("unstructured", 3)


@pytest.mark.parametrize(
    ("reasons", "remedy"),
    [
        ([Reason.TRIVIAL] + [Reason.DOES_NOT_FIT] * 20, "fewer --objects"),
        ([Reason.TRIVIAL] * 60, "another --hidden"),
    ],
)
def test_what_cannot_be_made_comes_with_a_remedy(reasons, remedy, monkeypatch, tmp_path, capsys):
    made = NotGenerated(len(reasons), Counter(reasons))
    monkeypatch.setattr(batch, "generate_problem", lambda *_, **__: made)
    code, out, _ = _torc("generate", "--objects", "50", "--out", tmp_path, capsys=capsys)
    assert (code, remedy in out) == (1, True)


def test_the_same_command_goes_on_where_it_was(jobs, tmp_path, capsys):
    arguments = ("generate", "--structured", "--out", tmp_path)
    assert _torc(*arguments, capsys=capsys)[0] == 0
    code, out, _ = _torc(*arguments, "--count", 3, capsys=capsys)
    assert code == 1
    assert "1 of 3 are in" in out
    assert "1 of 2 made beside the 1 that were there" in out
    assert [seed for _, seed in jobs] == [0, 1, 2]
    assert "Nothing was left to make" in _torc(*arguments, capsys=capsys)[1]
    code, out, _ = _torc(*arguments, "--json", capsys=capsys)
    assert (code, len(jobs)) == (0, 3)
    assert json.loads(out)["there"] == [str(tmp_path / "structured-s0000.yaml")]
    assert _torc(*arguments, "--overwrite", capsys=capsys)[0] == 0
    assert len(jobs) == 4


def test_what_was_made_otherwise_is_kept_unless_told_otherwise(jobs, tmp_path, capsys):
    arguments = ("generate", "--structured", "--out", tmp_path)
    assert _torc(*arguments, capsys=capsys)[0] == 0
    code, _, err = _torc(*arguments, "--objects", "9", capsys=capsys)
    assert code == 2
    assert "made otherwise" in err
    assert "--overwrite" in err
    assert len(jobs) == 1
    assert _torc(*arguments, "--objects", "9", "--overwrite", capsys=capsys)[0] == 0


@pytest.fixture
def reports(monkeypatch):
    """Validation that takes no time: a problem called `bad` is not valid."""

    def fake(problem, inspector, resolve, progress):
        asked.append(resolve)
        check = Check("rest", problem.name != "bad", "In 10 s nothing moves.")
        progress(check)
        return ValidationReport(problem.name, (check,), DIFFICULTY)

    asked = []
    monkeypatch.setattr(validation, "validate_problem", fake)
    return asked


def test_validation_says_what_it_found_and_exits_accordingly(reports, tmp_path, capsys):
    save_problem(SHIPPED, tmp_path / "a.yaml")
    code, out, _ = _torc("validate", tmp_path, capsys=capsys)
    assert code == 0
    assert reports[0] is not None
    assert "ok  rest:" in out
    assert "=> valid" in out
    save_problem(replace(SHIPPED, name="bad"), tmp_path / "b.yaml")
    code, out, _ = _torc("validate", tmp_path, capsys=capsys)
    assert code == 1
    assert "BAD rest:" in out
    assert "NOT VALID" in out
    assert "1 of 2 are valid" in out


def test_an_object_that_cannot_be_used_fails_its_problem_and_stops_nothing(object_store, tmp_path, capsys):
    save_object(replace(load_object("die_red"), name="thing"), object_store / "thing")
    it = replace(SHIPPED.objects[0], name="it", model="thing")
    for name in ("a", "b"):
        save_problem(replace(SHIPPED, name=name, objects=(*SHIPPED.objects, it)), tmp_path / f"{name}.yaml")
    path = object_store / "thing" / "object.yaml"
    path.write_text(path.read_text() + f'"\\e[2J{900 * "x"}": 1\n')
    code, out, err = _torc("validate", tmp_path, "--no-oracle", "--json", capsys=capsys)
    assert code == 1
    rows = json.loads(out)
    assert [row["problem"].rpartition("/")[2] for row in rows] == ["a.yaml", "b.yaml"]
    for row in rows:
        assert (row["valid"], row["difficulty"], len(row["checks"])) == (False, None, 1)
        assert row["checks"][0]["name"] == "objects"
    # What a stranger's file says does not reach the terminal raw.
    assert "BAD objects:" in err
    assert ("\\x1b[2Jxxx" in err, "\x1b" in err, len(err) < 4_000) == (True, False, True)


def test_validation_in_json(reports, capsys):
    code, out, err = _torc(
        "validate", "structured-04", "structured-04", "--no-oracle", "--json", capsys=capsys
    )
    (row,) = json.loads(out)
    assert code == 0
    assert reports == [None]
    assert row["problem"] == "structured-04"
    assert row["valid"] is True
    assert row["checks"][0]["name"] == "rest"
    assert row["difficulty"]["visible_fraction"] == 0.31
    assert "structured-04" in err
