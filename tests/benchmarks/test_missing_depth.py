"""The benchmark of missing depth: what its damages take, and what its table counts."""

import numpy as np
import pytest

from benchmarks import missing_depth


def test_damages_take_what_they_say(rng):
    depth_m = np.full((240, 320), 1.0, np.float32)
    depth_m[:, 160:] = 0.8
    for share in (0.01, 0.05):
        assert np.mean(missing_depth.speckles(share)(depth_m, rng)) == pytest.approx(share, rel=0.2)
        assert np.mean(missing_depth.blobs(share)(depth_m, rng)) == pytest.approx(share, rel=0.1)
    for px in (1, 2, 3):
        assert np.flatnonzero(missing_depth.edges(px)(depth_m, rng)[100]).tolist() == list(
            range(160 - px, 160 + px)
        )


def test_the_table_counts_grasps_over_all_frames_and_choices_by_frame():
    m = missing_depth
    damage = next(iter(m.DAMAGES))
    rows = [
        m.Row(damage, m.BRIDGED, full=30, found=27, sound=40, left=24, gained=3, full_choice=5, choice=5),
        m.Row(damage, m.BRIDGED, full=10, found=1, sound=10, left=0, gained=1, full_choice=5, choice=None),
        m.Row(damage, m.LEFT_OPEN, full=30, found=0, sound=40, left=0, gained=0, full_choice=5, choice=None),
        m.Row(damage, m.LEFT_OPEN, full=10, found=0, sound=10, left=0, gained=0, full_choice=5, choice=None),
    ]
    (line,) = [line for line in m.table(rows).splitlines() if line.startswith(f"| {damage} ")]
    cells = [cell.strip() for cell in line.split("|")[2:-1]]
    assert cells == ["0.70", "0.48", "0.08", "0.50", "1", "0.00", "0.00", "0.00", "0.00", "2"]
