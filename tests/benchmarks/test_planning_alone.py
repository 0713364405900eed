"""Planners compared without luck: the command's words and its table."""

import pytest

from benchmarks.planning_alone import planner_spec, table
from torc.errors import InputError


def test_settings_stand_behind_a_name():
    spec = planner_spec("belief:search.depth=1+prices.hold=false")
    assert (spec.name, spec.settings) == ("belief", {"search.depth": 1, "prices.hold": False})
    assert planner_spec("my_module:Mine").name == "my_module:Mine"
    with pytest.raises(InputError, match="setting"):
        planner_spec("belief:search.depth=1+nothing")
    with pytest.raises(InputError, match="oracle"):
        planner_spec("oracle")


def test_the_table_pairs_planners_by_problem():
    def row(hidden, *picks):
        return {
            "hidden": hidden,
            "shortest": 2,
            **{k: {"picks": p, "tries": float(p), "taken": p < 15} for k, p in zip("ab", picks)},
        }

    rows = {
        "p": row(True, 4, 3),
        "q": row(True, 5, 5),
        "r": row(False, 2, 15),
        "half": {"hidden": True, "a": {}},
    }
    text = table(rows, ["a", "b"])
    assert "| out of sight | shortest | 2 |" in text
    assert "| out of sight | b | 2 | 2 | 4.00" in text
    assert "1 / 0 |" in text
    assert "| in sight | b | 1 | 0 | 15.00" in text
    assert "30.00" in text  # tries of what never got there
