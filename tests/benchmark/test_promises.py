"""What grasps promised stands beside what came of them: every grasp that was carried out in one bin."""

from pathlib import Path

import numpy as np

from torc.benchmark.measures import DELIVERED, GRASPS, promises
from torc.benchmark.report.tables import promises_table
from torc.benchmark.rows import PickRow, Table, TrialRow

RESULTS = ("retrieved", "removed", "missed", "slipped", "stopped", "no motion plan")


def row(seed: int, n: int) -> TrialRow:
    rng = np.random.default_rng(seed)
    picks = []
    for k in range(n):
        result = str(rng.choice(RESULTS))
        held = result in ("retrieved", "removed", "slipped")
        p = (
            None
            if result == "no motion plan"
            else float(rng.choice([0.0, 0.5, 0.95, 0.98, 1.0, rng.random()]))
        )
        picks.append(PickRow(k, result, 1, 1, 0.0, 0.1, 0.1, 5.0, 0, held, False, "", p))
    return TrialRow(
        "", Path(f"t{seed}"), f"p{seed}", "structured", "random", seed, "completed", picked=tuple(picks)
    )


def test_every_grasp_that_was_carried_out_is_in_one_bin():
    rows = [row(seed, 40) for seed in range(5)]
    tried = [p for r in rows for p in r.picked if p.grasp_tried]
    bins = promises(rows)
    assert sum(len(picks) for _, _, picks in bins) == len(tried)
    for low, high, picks in bins:
        assert all(low <= p.p <= high for p in picks)
    assert [low for low, _, _ in bins][1:] == [high for _, high, _ in bins][:-1]


def test_delivered_is_a_part_of_held_and_the_table_says_both():
    rows = tuple(row(seed, 40) for seed in range(5))
    tried = [p for r in rows for p in r.picked if p.grasp_tried]
    assert GRASPS.of(rows).value == np.mean([p.held for p in tried])
    assert DELIVERED.of(rows).value == np.mean([p.result in ("retrieved", "removed") for p in tried])
    assert DELIVERED.of(rows).value < GRASPS.of(rows).value
    table = promises_table(Table(Path(), rows), ["random"])
    assert sum(int(cells[2]) for cells in table.rows) == len(tried)
    for cells in table.rows:
        assert float(cells[5]) <= float(cells[4])
