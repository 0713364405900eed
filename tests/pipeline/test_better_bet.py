"""A doubtful grasp waits where clearing a neighbour first takes fewer picks, and something is always left to try."""

import numpy as np
import pytest

from torc.pipeline.better_bet import BetConfig, hold_back_worse_bets
from torc.records import GraspReport, GraspSet, GraspStatus
from torc.task_planning.belief.costs import expected_picks

VALID, BLOCKED, UNLIKELY = GraspStatus.VALID, GraspStatus.BLOCKED, GraspStatus.UNLIKELY
Grasp = tuple[int, float, GraspStatus, tuple[int, ...]]
"""Object, score, status, and which objects block it."""


def situation(*rows: Grasp) -> tuple[GraspReport, GraspSet]:
    n, ids = len(rows), tuple(sorted({row[0] for row in rows}))
    grasps = GraspSet(
        Ts_world_tcp=np.tile(np.eye(4), (n, 1, 1)),
        widths_m=np.full(n, 0.04),
        scores=np.array([row[1] for row in rows]),
        object_ids=np.array([row[0] for row in rows], dtype=np.int16),
        contacts=np.zeros((n, 2, 3)),
        generators=np.zeros(n, dtype=np.uint8),
        generator_names=("test",),
    )
    status = np.array([row[2] for row in rows], dtype=np.uint8)
    bits = np.array([sum(1 << b for b in row[3]) for row in rows], dtype=np.uint64)
    k = len(ids)
    valid = [sum(row[0] == i and row[2] == VALID for row in rows) for i in ids]
    report = GraspReport(
        status,
        np.zeros((n, 7)),
        bits,
        ids,
        np.zeros((k, k), dtype=np.int32),
        np.zeros(k, dtype=np.int32),
        np.array(valid, dtype=np.int32),
    )
    return report, grasps


def waiting(*rows: Grasp, picks_left: int = 14, lost_share: float = 0.15) -> set[int]:
    report, grasps = situation(*rows)
    after = hold_back_worse_bets(report, grasps, 0, picks_left, BetConfig(lost_share))
    return set(report.graspable_ids) - set(after.graspable_ids)


@pytest.mark.parametrize(("p", "lost_share"), [(0.3, 0.0), (0.5, 0.15), (0.9, 0.15), (0.2, 1.0)])
def test_expected_picks_are_the_mean_of_many_tries(p, lost_share):
    rng, left, n = np.random.default_rng(0), 12, 40_000
    spent, open_ones = np.zeros(n), np.ones(n, dtype=bool)
    while open_ones.any():
        spent += open_ones
        fails = rng.random(n) >= p
        lost = open_ones & fails & (rng.random(n) < lost_share)
        spent += lost * left
        open_ones &= fails & ~lost
    assert spent.mean() == pytest.approx(expected_picks(p, lost_share, left), rel=0.03)


def test_a_doubtful_target_waits_for_the_one_thing_in_the_way_of_a_better_grasp():
    rows = (0, 0.5, VALID, ()), (0, 0.95, BLOCKED, (3,)), (3, 0.97, VALID, ())
    assert waiting(*rows) == {0}
    # Not where it can hardly be lost, nor where clearing gains too little, nor where what is in the way cannot go.
    assert waiting(*rows, lost_share=0.0) == set()
    assert waiting(*rows, picks_left=2) == set()
    assert waiting((0, 0.8, VALID, ()), *rows[1:]) == set()
    assert waiting(rows[0], rows[1], (3, 0.3, VALID, ())) == set()
    assert waiting(rows[0], rows[1], (3, 0.97, BLOCKED, (5,))) == set()
    assert waiting(rows[0], (0, 0.95, BLOCKED, ()), rows[2]) == set()


def test_two_in_the_way_are_waited_for_where_both_can_go_and_it_is_worth_both():
    behind_two = (0, 0.95, BLOCKED, (3, 4)), (3, 0.97, VALID, ()), (4, 0.97, VALID, ())
    assert waiting((0, 0.5, VALID, ()), *behind_two) == {0}
    assert waiting((0, 0.6, VALID, ()), *behind_two) == set()
    assert waiting((0, 0.5, VALID, ()), *behind_two[:2]) == set()
    assert waiting((0, 0.5, VALID, ()), *behind_two[:2], (4, 0.97, BLOCKED, (3,))) == set()


def test_others_wait_only_where_tries_alone_cost_more():
    rows = (5, 0.3, VALID, ()), (5, 0.95, BLOCKED, (3,)), (3, 0.97, VALID, ())
    assert waiting(*rows) == {5}
    assert waiting((5, 0.6, VALID, ()), *rows[1:]) == set()


def test_nothing_waits_for_the_target():
    assert waiting((5, 0.1, VALID, ()), (5, 0.99, BLOCKED, (0,)), (0, 0.99, VALID, ())) == set()


@pytest.mark.parametrize("seed", range(40))
def test_something_is_always_left_to_try_and_only_valid_grasps_change(seed):
    rng = np.random.default_rng(seed)
    rows: list[Grasp] = []
    for k in range(int(rng.integers(2, 8))):
        for _ in range(int(rng.integers(1, 5))):
            blocked = rng.random() < 0.5
            others = tuple(
                rng.choice([j for j in range(8) if j != k], int(rng.integers(1, 3)), replace=False)
            )
            rows.append((k, float(rng.random()), BLOCKED if blocked else VALID, others if blocked else ()))
    report, grasps = situation(*rows)
    after = hold_back_worse_bets(report, grasps, 0, int(rng.integers(1, 16)), BetConfig())
    changed = report.status != after.status
    assert np.all(report.status[changed] == VALID)
    assert np.all(after.status[changed] == UNLIKELY)
    assert bool(after.graspable_ids) == bool(report.graspable_ids)
    for k in report.object_ids:
        of = grasps.object_ids[changed] == k
        assert of.any() == (report.has_valid_grasp(k) and not after.has_valid_grasp(k))
