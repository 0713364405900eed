"""Decisions of a real problem: where they are taken, how they are numbered, and rows made of them."""

import json

import numpy as np
import pytest

from torc.cli.main import parse
from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError
from torc.pipeline.building import build_system
from torc.problems.problem import load_problem
from torc.records import TARGET_ID, GraspStatus
from torc.specs.conditions import Conditions
from torc.vlm.question_facts import grasp_facts
from torc_next_object.data.checking import check_directory
from torc_next_object.making import rows as rows_module
from torc_next_object.making.looks import Looks
from torc_next_object.making.numbering import drawn_numbers, renumbered
from torc_next_object.making.rows import MakingConfig, RowMaker
from torc_next_object.making.valuing import Valued
from torc_next_object.making.visits import MOST_DEEP, visits


@pytest.fixture(scope="module")
def looks():
    problem = load_problem("validation-unstructured-01")
    with open_sandbox(problem, build_system(Conditions()), EpisodeConfig(15, 0)) as sandbox:
        yield Looks(sandbox)


def test_decisions_begin_at_the_first_look_and_none_is_taken_twice(looks):
    found = visits(looks.context, 4, np.random.default_rng(1))
    assert found[0] == frozenset()
    assert len(set(found)) == len(found) > 1
    easy = 0
    for gone in found:
        graspable = looks.context(gone).graspable_ids
        assert len(graspable) >= 2
        assert len(gone) <= MOST_DEEP
        easy += TARGET_ID in graspable
    assert easy <= 1


def test_drawn_numbers_are_one_to_n_and_leave_the_target_its_own():
    draws = [drawn_numbers((0, 3, 7, 9), np.random.default_rng(seed)) for seed in range(60)]
    assert all(drawn[TARGET_ID] == TARGET_ID for drawn in draws)
    assert all(sorted(drawn.values()) == [0, 1, 2, 3] for drawn in draws)
    assert {drawn[3] for drawn in draws} == {1, 2, 3}
    assert drawn_numbers((4,), np.random.default_rng(0)) == {4: 1}


def test_a_look_with_new_numbers_tells_the_same(looks):
    context = looks.context(frozenset())
    numbers = drawn_numbers(context.scene.ids, np.random.default_rng(2))
    shown = renumbered(context, numbers)
    assert shown.scene.ids == tuple(sorted(numbers.values()))
    for old, new in numbers.items():
        assert np.array_equal(context.scene.label_image == old, shown.scene.label_image == new)
        valid = [
            (c.report.status == GraspStatus.VALID) & (c.grasps.object_ids == k)
            for c, k in ((context, old), (shown, new))
        ]
        assert np.array_equal(*valid)
        assert (old in context.graspable_ids) == (new in shown.graspable_ids)
    # Who blocks whom, too: as many pairs, and between the same objects.
    pairs = [
        {
            (c.report.object_ids[i], c.report.object_ids[j], int(c.report.blocking[i, j]))
            for i, j in zip(*np.nonzero(c.report.blocking))
        }
        for c in (context, shown)
    ]
    assert {(numbers[i], numbers[j], n) for i, j, n in pairs[0] if {i, j} <= set(numbers)} == pairs[1]
    assert len(grasp_facts(context)) == len(grasp_facts(shown))


@pytest.mark.long
def test_a_decision_after_which_no_order_was_found_is_left_out(monkeypatch):
    unknown = Valued({}, {1: (), 2: ()}, (), 1, False)
    monkeypatch.setattr(rows_module, "value_choices", lambda *_: unknown)
    maker = RowMaker(MakingConfig(per_problem=1))
    assert list(maker.rows(load_problem("validation-unstructured-01"), lambda key: False)) == []


@pytest.mark.long
def test_without_looks_only_the_decisions_are_made_whose_values_are_known(tmp_path):
    values = tmp_path / "values.jsonl"
    line = ["next-object", "make", "--problems", "validation-unstructured-01", "--values", str(values)]
    with pytest.raises(InputError, match=r"No values are known"):
        parse([*line, "--out", str(tmp_path / "none"), "--looks", "0"]).run()
    parse([*line, "--out", str(tmp_path / "a"), "--looks", "2", "--decisions", "1"]).run()
    known = values.read_bytes()
    parse([*line, "--out", str(tmp_path / "b"), "--looks", "0"]).run()
    assert check_directory(tmp_path / "a")[0] == check_directory(tmp_path / "b")[0]
    assert values.read_bytes() == known
    parse([*line, "--out", str(tmp_path / "b"), "--looks", "2", "--per-problem", "2"]).run()
    assert len(check_directory(tmp_path / "b")[0]) == 2


@pytest.mark.long
def test_a_problem_in_a_workspace_of_its_own_gives_rows():
    maker = RowMaker(MakingConfig(per_problem=1, most_looks=2))
    (row,) = maker.rows(load_problem("deep-01"), lambda key: False)
    assert row.source == "hard"
    assert sum(row.graspable) >= 2


@pytest.mark.long
def test_rows_are_made_gone_on_with_and_numbered_by_the_key(tmp_path, capsys):
    def make(out, *more):
        line = [
            "next-object",
            "make",
            "--problems",
            "validation-unstructured-01",
            "--out",
            str(tmp_path / out),
        ]
        assert parse([*line, "--per-problem", "2", "--looks", "5", *more]).run() == 0
        return {row.id: row for row in check_directory(tmp_path / out)[0]}

    first = make("a", "--decisions", "1")
    assert len(first) == 1
    both = make("a")
    assert len(both) == 2
    assert first.items() <= both.items()
    assert check_directory(tmp_path / "a")[1] == []
    assert make("a") == both
    assert "0 new decisions" in capsys.readouterr().out
    again = make("b", "--decisions", "1")
    assert again == first
    assert make("d", "--workers", "2") == both
    hidden = make("c", "--decisions", "1", "--hidden-seed", "only-the-host-knows")
    (row,), (secret,) = first.values(), hidden.values()
    assert secret.split == "hidden"
    assert secret.id != row.id
    assert secret.scene != row.scene
    assert sorted(secret.values) == pytest.approx(sorted(row.values))
    texts = [p.read_bytes() for p in (tmp_path / "c").rglob("*") if p.is_file()]
    assert not any(b"only-the-host-knows" in text or b"unstructured-01" in text for text in texts)
    assert not (tmp_path / "c" / "reference.json").exists()
    chosen = json.loads(row.baselines)
    assert {"random", "first", "largest", "nearest", "dg-select", "belief", "learned"} <= set(chosen)
    assert row.values[row.numbers.index(row.best[0])] == row.best_value <= row.random_value
