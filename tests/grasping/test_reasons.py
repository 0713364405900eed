"""Why nothing can be grasped, by counts."""

import numpy as np
import pytest

from torc.grasping.reasons import why_none_is_valid
from torc.records import GraspReport, GraspStatus


def report(statuses, objects=2):
    n = len(statuses)
    zeros = np.zeros(objects, np.int32)
    return GraspReport(
        np.array(statuses, np.uint8),
        np.full((n, 7), np.nan),
        np.zeros(n, np.uint64),
        tuple(range(objects)),
        np.zeros((objects, objects), np.int32),
        zeros,
        zeros,
    )


@pytest.mark.parametrize(
    ("statuses", "words"),
    [
        (
            [GraspStatus.UNREACHABLE] * 502,
            "of 502 grasps 502 out of reach. Is the robot's base where you think it is",
        ),
        (
            [GraspStatus.UNREACHABLE] * 5 + [GraspStatus.BLOCKED] * 7,
            "of 12 grasps 7 blocked by other objects, 5 out of reach.",
        ),
        (
            [GraspStatus.HITS_STATIC] * 20,
            "Are the height of the table, and the obstacles of the workspace, right?",
        ),
        ([], "no way to grip any of them was found"),
    ],
)
def test_counts_and_remedies(statuses, words):
    text = why_none_is_valid(report(statuses))
    assert words in text
    assert text.count("?") == (1 if "?" in words or "base" in words else 0)


def test_nothing_in_sight():
    assert why_none_is_valid(report([], objects=0)) == "No object is in sight."
