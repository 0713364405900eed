"""The laws of scores: best is 0, a random choice 1, an invalid answer as a random one."""

import json

import numpy as np
import pytest

from torc_next_object.scoring import score_answer, score_answers


def row(key: int, values, random_value=None, hidden=True):
    values = [float(v) for v in values]
    return {
        "id": f"r{key:03}",
        "scene": f"s{key // 2}",
        "source": "torc40",
        "category": "structured",
        "target_hidden": hidden,
        "numbers": list(range(1, len(values) + 1)),
        "values": values,
        "random_value": float(np.mean(values)) if random_value is None else random_value,
    }


ROWS = [row(i, np.random.default_rng(i).uniform(1, 5, 3 + i % 7), hidden=i % 2 == 0) for i in range(30)]


def best(r):
    return r["numbers"][int(np.argmin(r["values"]))]


def test_the_best_choices_lose_nothing():
    scores = score_answers((r, best(r)) for r in ROWS)
    assert (scores.regret, scores.top1, scores.invalid, scores.lost) == (0, 1, 0, 0)


def test_invalid_answers_score_as_random_ones_and_are_told_apart():
    for wrong in (None, 99, -1, True, "1"):
        scores = score_answers((r, wrong) for r in ROWS)
        assert scores.regret == pytest.approx(1.0)
        assert (scores.top1, scores.invalid) == (0, 1)


def test_all_choices_together_are_as_a_random_one():
    for r in ROWS:
        regrets = [score_answer(r, n).regret for n in r["numbers"]]
        assert np.mean(regrets) == pytest.approx(1.0)


def test_choices_as_good_as_the_best_count_as_best():
    tied = row(1, [2.0, 2.05, 2.06, 4.0])
    assert [score_answer(tied, n).top1 for n in tied["numbers"]] == [True, True, False, False]


def test_a_row_in_which_nothing_can_be_lost_has_no_regret():
    even = row(1, [2.0, 2.0])
    assert score_answer(even, 1).regret is None
    scores = score_answers([(even, 1)])
    assert (scores.regret, scores.regret_low, scores.counted, scores.top1) == (None, None, 0, 1)


def test_neither_order_nor_types_change_a_digit():
    answers = [(r, r["numbers"][i % len(r["numbers"])]) for i, r in enumerate(ROWS)]
    one = score_answers(answers).to_dict()
    as_arrays = [
        ({**r, "values": np.array(r["values"]), "numbers": tuple(r["numbers"])}, n) for r, n in answers
    ]
    assert score_answers(reversed(as_arrays)).to_dict() == one
    assert json.loads(json.dumps(one)) == one


def test_groups_part_the_rows_and_intervals_hold_the_score():
    scores = score_answers((r, r["numbers"][0]) for r in ROWS).to_dict()
    for groups in scores["by"].values():
        assert sum(g["rows"] for g in groups.values()) == len(ROWS)
    assert scores["regret_low"] <= scores["regret"] <= scores["regret_high"]
    assert scores["by"]["target"]["hidden"]["rows"] == 15


def test_answers_are_scored_once_each_and_not_none():
    with pytest.raises(ValueError, match="twice"):
        score_answers([(ROWS[0], 1), (ROWS[0], 2)])
    with pytest.raises(ValueError, match="no answers"):
        score_answers([])


@pytest.mark.parametrize(
    ("values", "name"), [([1.0, 9.0], "easy"), ([2.1, 2.2], "medium"), ([8.0, 2.6], "hard")]
)
def test_how_hard_a_decision_is_says_how_far_the_target_is(values, name):
    assert dict(score_answer(row(1, values), None).groups)["difficulty"] == name
