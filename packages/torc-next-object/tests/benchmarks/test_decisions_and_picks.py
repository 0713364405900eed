"""The correlation between single decisions and whole trials."""

from pathlib import Path

import numpy as np
import pytest
from decisions_and_picks import correlation, whole

from torc.benchmark.rows import TrialRow


def made_up(shuffled):
    rng = np.random.default_rng(0)
    skills = {f"d{i}": i / 10 for i in range(11)}
    order = dict(zip(skills, rng.permutation(list(skills.values())) if shuffled else skills.values()))
    regrets = {
        n: {f"s{s}": np.array([skill + rng.normal(0, 0.1), 1.0]) for s in range(40)}
        for n, skill in skills.items()
    }
    picks = {
        n: {f"p{p}": [3 + 5 * skill + rng.normal(0, 0.5)] for p in range(40)} for n, skill in order.items()
    }
    return regrets, picks


def test_deciders_in_one_order_correlate_and_others_do_not():
    rank, low, high, table = correlation(*made_up(shuffled=False))
    assert rank == pytest.approx(1.0, abs=0.02)
    assert 0.9 < low <= rank <= high
    assert table["d10"][0] == pytest.approx(1.0, abs=0.1)
    assert table["d10"][1] == pytest.approx(8.0, abs=0.5)
    assert correlation(*made_up(shuffled=True))[0] < 0.7


def test_only_deciders_measured_both_ways_count():
    regrets, picks = made_up(shuffled=False)
    del regrets["d3"], picks["d5"]
    assert set(correlation(regrets, picks)[3]) == {f"d{i}" for i in range(11)} - {"d3", "d5"}


def test_trials_count_for_the_names_of_the_data_set():
    def row(planner, seed=0, **more):
        facts = {"status": "completed", "retrieved": True, "end": "retrieved", "picks": 3, "max_picks": 15}
        return TrialRow(
            id="",
            directory=Path(),
            problem="p",
            category="structured",
            planner=planner,
            seed=seed,
            **facts | more,
        )

    rows = [
        row("vlm-grasps[simulated 0.5]"),
        row("decisions_and_picks:First", retrieved=False, end="budget spent"),
        row("dg-select"),
        row("dg-select", seed=1, picks=4),
        row("random", status="errored"),
    ]
    assert whole(rows) == {"simulated-0.5": {"p": [3]}, "first": {"p": [15]}, "dg-select": {"p": [3, 4]}}
