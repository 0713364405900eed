"""Problems survive the disk exactly, faults in a file are named with a remedy, and what a user may name is found."""

import shutil
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from torc.errors import InputError, UnknownNameError
from torc.objects.library import builtin_object_names
from torc.problems.problem import (
    ObjectPlacement,
    Problem,
    load_problem,
    parse_problem,
    problem_text,
    robot_hint,
    robot_wanted,
    save_problem,
)
from torc.problems.sets import problem_names, problem_sets, select_problems, shipped_path
from torc.problems.summaries import problem_summary

GOOD = """\
format: torc-problem/1
name: demo
category: structured
description: A demo.
target: mug
objects:
- name: can
  model: soup_can_red
  position: [0.6, -0.1, 1.1]
  wxyz: [1, 0, 0, 0]
- name: mug
  model: mug_red
  position: [0.7, -0.1, 1.1]
"""


def test_a_good_file_loads_and_the_target_comes_first(tmp_path: Path) -> None:
    (tmp_path / "demo.yaml").write_text(GOOD)
    problem = load_problem(tmp_path / "demo.yaml")
    assert [o.name for o in problem.ordered()] == ["mug", "can"]
    assert problem.objects[1].wxyz == (1.0, 0.0, 0.0, 0.0)
    np.testing.assert_allclose(problem.objects[0].T_world_object[:3, 3], [0.6, -0.1, 1.1])


def _poses() -> st.SearchStrategy:
    x, y, z = st.floats(0.42, 1.1), st.floats(-0.68, 0.56), st.floats(1.04, 2.0)
    unit = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 1e-3)
    return st.tuples(
        st.tuples(x, y, z), unit.map(lambda q: tuple(float(v) for v in np.array(q) / np.linalg.norm(q)))
    )


@settings(
    max_examples=40,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    poses=st.lists(_poses(), min_size=1, max_size=6),
    notes=st.text(st.characters(codec="utf-8").filter(lambda c: c.isprintable() or c == "\n"), max_size=30),
    seed=st.integers(0, 9),
)
def test_saving_and_loading_gives_back_the_same_problem(
    tmp_path: Path, poses: list, notes: str, seed: int
) -> None:
    names = builtin_object_names()
    objects = tuple(
        ObjectPlacement(f"o{i}", names[(seed + i) % len(names)], position, wxyz)
        for i, (position, wxyz) in enumerate(poses)
    )
    problem = Problem(
        "p", "unstructured", notes, "o0", objects, notes, {"seed": seed, "generator": "test", "share": 0.1}
    )
    save_problem(problem, tmp_path / "p.yaml")
    assert load_problem(tmp_path / "p.yaml") == problem
    assert [f.name for f in tmp_path.iterdir()] == ["p.yaml"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mug_red", "mug_rde", r"objects\[1\].model: there is no object model 'mug_rde'.* mean 'mug_red'\?"),
        ("name: can", "name: mug", r"objects: names must be unique; more than once: mug\. Rename"),
        ("target: mug", "target: mugg", "target: Unknown object 'mugg'. Did you mean 'mug'"),
        ("[0.6,", "[.nan,", r"objects\[0\].position\[0\]: must be a finite number"),
        ("[0.6,", "[true,", r"objects\[0\].position\[0\]: must be a number, not true or false"),
        ("[0.6,", "[6.0,", r"objects\[0\].position: .*not over the table"),
        ("-0.1, 1.1]\n  wxyz", "-0.1, 0.1]\n  wxyz", r"objects\[0\].position: .*not over the table"),
        ("[0.6, ", "[", r"objects\[0\].position\[2\]: is missing"),
        ("[1, 0, 0, 0]", "[0, 0, 0, 0]", r"objects\[0\].wxyz: a rotation must not be zero"),
        ("name: demo", "name: ../demo", "name: must be 1 to 64 letters"),
        ("name: can", "name: 12", r"objects\[0\].name: must be text; put it in quotes"),
        ("structured", "tidy", "category: Input should be 'structured' or 'unstructured'"),
        ("problem/1", "problem/9", "format: .*torc-problem/1"),
        ("name: demo", "name: demo\nname: two", "'name' is given 2 times"),
        ("A demo.", r'"a \e[2J demo"', "description: has characters that cannot be printed"),
        ("A demo.", "!!python/object:os.system x", "tags .* are not supported"),
        ("target:", f"origin: {dict.fromkeys(map(str, range(101)), 1)}\ntarget:", "too many entries"),
        ("A demo.", "&a text\nnotes: *a", "aliases"),
        ("A demo.", "'unclosed", "not readable YAML"),
    ],
)
def test_faults_name_file_field_and_remedy(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    path = tmp_path / "bad.yaml"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as info:
        load_problem(path)
    assert str(path) in str(info.value)


def test_rotations_are_normalised_once() -> None:
    problem = parse_problem(GOOD.replace("[1, 0, 0, 0]", "[1, 0, 0, 1]"))
    assert np.linalg.norm(problem.objects[0].wxyz) == pytest.approx(1.0)
    assert parse_problem(problem_text(problem)) == problem


def test_shipped_problems_load_under_their_own_name() -> None:
    assert "structured-01" in problem_names()
    for name in problem_names():
        assert load_problem(name).name == name


def test_unknown_problems_are_reported() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'structured-") as near:
        load_problem("structured-1")
    assert "Known:" not in str(near.value)
    with pytest.raises(UnknownNameError) as far:
        load_problem("nothing-like-it")
    for told in (near, far):
        assert f"`torc problems list` lists all {len(problem_names())}" in str(told.value)
    assert sum(name in str(far.value) for name in problem_names()) == UnknownNameError.FEW
    for name in problem_sets():
        with pytest.raises(InputError, match=f"play all with torc bench --problems {name}"):
            load_problem(name)
    with pytest.raises(InputError, match="no problem file"):
        load_problem("nowhere/problem.yaml")


PROBLEM = load_problem("structured-04")
OWN = replace(PROBLEM, origin={"robot": "my_robot", "robot_source": "a1"})


def test_only_another_robot_is_hinted_at():
    assert robot_wanted(OWN) == "my_robot"
    assert "'my_robot': give its file with --robot" in robot_hint(OWN, "another", "b2")
    assert "'my_robot' before its files were changed" in robot_hint(OWN, "my_robot", "b2")
    assert robot_hint(OWN, "renamed", "a1") == ""


def test_others_are_for_whatever_robot_there_is():
    for problem in (PROBLEM, replace(PROBLEM, origin={"robot": "a word of somebody's own"})):
        assert robot_wanted(problem) == ""
        assert robot_hint(problem, "my_robot", "b2") == ""


def test_the_sets_part_the_problems() -> None:
    names = [name for s in problem_sets() for name in problem_names(s)]
    assert "torc40" in problem_sets()
    assert sorted(names) == sorted(problem_names())
    assert len(set(names)) == len(names)
    with pytest.raises(UnknownNameError, match="torc40"):
        problem_names("torc4")


def test_sets_names_files_and_directories_can_be_mixed(tmp_path: Path) -> None:
    first, second, third = problem_names()[:3]
    shutil.copy(shipped_path(first), tmp_path / "mine.yaml")
    mine = str(tmp_path / "mine.yaml")
    assert select_problems(f"{second}, {mine},{tmp_path},{third},{second}") == (second, mine, third)
    assert select_problems("torc40") == problem_names("torc40")


@pytest.mark.parametrize("selection", ["", " , ", "torc41", "no/such/place"])
def test_what_is_not_there_is_said(selection: str) -> None:
    with pytest.raises(InputError):
        select_problems(selection)


ABSENT = GOOD.replace("target: mug\n", "target: spoon\ntarget_model: spoon_steel\n")


def test_a_target_that_is_not_there_keeps_its_id_and_is_none_of_the_objects() -> None:
    problem = parse_problem(ABSENT)
    assert problem.absent
    assert [o.name for o in problem.ordered()] == ["spoon", "can", "mug"]
    assert [o.name for o in problem.objects] == ["can", "mug"]
    assert parse_problem(problem_text(problem)) == problem
    assert "target_model" not in problem_text(parse_problem(GOOD))


def test_a_target_is_one_of_the_objects_or_of_a_known_model() -> None:
    with pytest.raises(InputError, match="Leave target_model out"):
        parse_problem(GOOD.replace("target: mug\n", "target: mug\ntarget_model: mug_red\n"))
    with pytest.raises(InputError, match="give the target_model"):
        parse_problem(GOOD.replace("target: mug\n", "target: spoon\n"))
    for wrong, words in (
        ("spoon_of_gold", "there is no object model"),
        ("../spoon", "must be 1 to 64 letters"),
    ):
        with pytest.raises(InputError, match=rf"file:\n  target_model: {words}.*\nCompare"):
            parse_problem(ABSENT.replace("spoon_steel", wrong))


def test_wrong_objects_get_one_line_each() -> None:
    with pytest.raises(InputError) as error:
        parse_problem(GOOD.replace("soup_can_red", "nothing").replace("mug_red", "nothing"))
    assert [line.split(":")[0] for line in str(error.value).split("\n")[1:-1]] == [
        "  objects[0].model",
        "  objects[1].model",
    ]
    head = GOOD[: GOOD.index("objects:")]
    for objects, words in (("3", "must be a list"), ("[]", "holds too few entries")):
        with pytest.raises(InputError, match=rf"file:\n  objects: {words}\nCompare"):
            parse_problem(f"{head}objects: {objects}\n")


def test_a_summary_says_what_the_whole_file_says(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(GOOD)
    for name in (*problem_names(), str(tmp_path / "mine.yaml")):
        problem = load_problem(name)
        expected = (problem.name, problem.category, len(problem.objects), problem.description)
        assert astuple(problem_summary(name)) == expected
    with pytest.raises(InputError):
        problem_summary("no_such_problem")
