"""`torc problems generate` and `validate` as a user meets them: files, words, exit codes."""

import json
from dataclasses import replace
from functools import partial

import pytest

from tests.helpers.graspclutter6d_tree import upright, write_tree
from tests.helpers.plain_mesh_reader import read_plain_mesh
from tests.helpers.torc_command import run_torc
from torc.generation import generator, validation
from torc.generation.config import Hiddenness, Reason
from torc.generation.generator import GeneratedProblem, NotGenerated
from torc.generation.graspclutter6d import placing
from torc.generation.inspection import Difficulty
from torc.generation.validation import Check, ValidationReport
from torc.oracle.answer import ForeseenPick, OracleAnswer
from torc.problems.problem import load_problem, save_problem
from torc.records import PickOutcome, PickResult

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

    def same(problem, config, seed, robot, workspace):
        return problem.origin.get("made from") == str((config, seed))

    monkeypatch.setattr(generator, "generate_problem", fake)
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


@pytest.fixture
def answer(monkeypatch):
    """What the solver answers, whatever it is asked; the questions are noted."""
    foreseen = (
        ForeseenPick(
            3, "box", PickOutcome(PickResult.REMOVED, 3, 3, True, True, (5,)), "the target is hidden"
        ),
        ForeseenPick(0, "can", PickOutcome(PickResult.RETRIEVED, 0, 0, True, True), ""),
    )
    given = {"asked": []}

    def solve(problem, system, seed, budget, *, say):
        given["asked"].append((problem.name, seed, budget, system.conditions.max_picks))
        say("oracle: at it")
        return OracleAnswer(problem.name, seed, budget, True, foreseen, 1, True, 2, 2, 4, 9)

    monkeypatch.setattr("torc.oracle.solve.solve_problem", solve)
    return given


def test_it_prints_the_order_and_how_good_it_is(answer, capsys):
    code, out, err = run_torc(
        "problems", "solve", "structured-01", "--seed", "3", "--budget", "5", capsys=capsys
    )
    assert code == 0
    assert answer["asked"] == [("structured-01", 3, 5.0, 15)]
    assert "structured-01, seed 3: 2 picks, 1 drop; no order does with less (proved)." in out
    assert "1  box  removed, 1 drop; then the target is hidden" in out
    assert "4 picks tried, 9 looks" in out
    assert "at it" in err


OBJECTS = (upright(17, 0.0, 0.0, 0.3), upright(48, 0.10, 0.05), upright(56, -0.10, 0.02, 1.0))


_import = partial(run_torc, "problems", "import")


@pytest.fixture
def root(tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "store"))
    monkeypatch.setattr(placing, "read_mesh", read_plain_mesh)
    write_tree(tmp_path / "gc6d", {249: OBJECTS}, images=15)
    return tmp_path / "gc6d"


def test_a_scene_becomes_a_problem_file(root, tmp_path, capsys):
    code, out, _ = _import(root, "--scene", 249, "--target", "48", "--out", tmp_path / "out", capsys=capsys)
    assert code == 0
    assert "the can of green beans" in out
    assert "1 of 1 problems" in out
    (file,) = (tmp_path / "out").iterdir()
    assert str(file) in out.replace("\n", "")
    code, out, _ = _import(root, "--scene", 249, "--target", "48", "--out", tmp_path / "out", capsys=capsys)
    assert code == 0
    assert f"there  scene 249, obj_000048_0: {file}" in out
    assert "1 of 1 problems" in out


def test_json_holds_what_was_made_and_what_was_not(root, tmp_path, capsys):
    arguments = (root, "--paper", "--scene", 249, "--scene", 251, "--out", tmp_path / "out", "--json")
    code, out, _ = _import(*arguments, capsys=capsys)
    rows = json.loads(out)
    assert code == 1
    assert [(r["scene"], r["target"], bool(r["file"])) for r in rows] == [
        (249, "obj_000017_0", True),
        (249, "obj_000048_0", True),
        (251, "obj_000046_0", False),
        (251, "obj_000049_0", False),
    ]
    assert "is missing" in rows[2]["reason"]
    assert rows[0]["category"] == "structured"
    assert 0.0 <= rows[0]["in_sight"] <= 1.0
