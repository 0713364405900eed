"""The sets take what their rules say, by seed, and nothing else."""

import json

import pytest

from tools.hard_sets import RULES, Answered, Rule, choose, named, read_answered
from torc.errors import InputError
from torc.problems.problem import ObjectPlacement, Problem, save_problem

CAN = ObjectPlacement("can", "soup_can_red", (0.7, -0.1, 1.1005), (1.0, 0.0, 0.0, 0.0))
MILK = ObjectPlacement("milk", "milk_carton_blue", (0.6, -0.09, 1.165), (1.0, 0.0, 0.0, 0.0))


def _answered(seed, picks, family="ungraspable", category="structured"):
    origin = {"seed": seed, "family": family}
    problem = Problem(f"{family}-{category}-s{seed}", category, "", "can", (CAN, MILK), origin=origin)
    return Answered(problem, picks, ("milk", "can"))


def test_the_first_by_seed_with_enough_picks_are_taken():
    pool = [_answered(seed, picks) for seed, picks in ((4, 3), (1, 2), (3, None), (2, 1), (5, 16), (6, 2))]
    chosen = choose("ungraspable", pool, Rule({"structured": 2}))
    assert [c.seed for (c,) in chosen] == [1, 4]


def test_each_category_gets_its_number_and_no_more():
    pool = [_answered(s, 3, category=c) for s in range(9) for c in ("structured", "unstructured")]
    chosen = choose("ungraspable", pool, Rule({"structured": 3, "unstructured": 2}))
    assert [c.problem.category for (c,) in chosen].count("structured") == 3
    assert len(chosen) == 5


def test_pairs_are_taken_where_both_can_be_solved():
    pool = [_answered(s, 3, "absent") for s in range(4)]
    pool += [
        _answered(0, 3, "absent-twin"),
        _answered(1, None, "absent-twin"),
        _answered(3, 2, "absent-twin"),
    ]
    pairs = choose("absent", pool, Rule({"structured": 5}, twins=True))
    assert [(a.seed, b.seed) for a, b in pairs] == [(0, 0), (3, 3)]
    names = [p.name for p in named("absent", pairs)]
    assert names == ["absent-01", "absent-01-twin", "absent-02", "absent-02-twin"]
    assert all(p.origin["oracle_order"] == "milk, can" for p in named("absent", pairs))


def test_deep_problems_are_usual_ones_in_other_workspaces():
    pool = [_answered(s, 3, f) for s, f in enumerate(("ungraspable", "", "absent", ""))]
    assert [c.seed for (c,) in choose("deep", pool, RULES["deep"])] == [1, 3]


def test_every_set_has_twenty_problems():
    for rule in RULES.values():
        assert sum(rule.each.values()) * (2 if rule.twins else 1) == 20


def test_candidates_without_an_answer_do_not_count(tmp_path):
    problem = _answered(7, None).problem
    save_problem(problem, tmp_path / f"{problem.name}.yaml")
    with pytest.raises(InputError, match="No answer"):
        read_answered(str(tmp_path), tmp_path)
    answer = {"solved": True, "picks": 2, "order": ["milk", "can"]}
    (tmp_path / f"{problem.name}-0.json").write_text(json.dumps(answer))
    (found,) = read_answered(str(tmp_path), tmp_path)
    assert (found.picks, found.order, found.seed) == (2, ("milk", "can"), 7)
