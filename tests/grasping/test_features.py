"""Features against slow definitions, written from their one-line docs."""

import numpy as np
import pytest
from grasping_scenes import TABLE_Z, standing_box
from hand_reference import in_grasp_frame, tip_shift

from torc.grasping.clouds import build_clouds
from torc.grasping.config import GraspConfig
from torc.grasping.features import FEATURE_NAMES
from torc.testing.views import view_of, view_of_clutter

CONFIG = GraspConfig()


class Case:
    """One candidate with its clouds, in the grasp frame."""

    def __init__(self, found, clouds, view, gripper, i):
        self.row = dict(zip(FEATURE_NAMES, found.features[i].astype(float)))
        self.T, self.width = found.grasps.Ts_world_tcp[i], float(found.grasps.widths_m[i])
        self.own = int(found.grasps.object_ids[i])
        self.cloud = next(c for c in clouds.objects if c.id == self.own)
        self.p = in_grasp_frame(self.T, self.cloud.points)
        self.n = self.cloud.normals @ self.T[:3, :3]
        self.seen = np.arange(len(self.p)) < self.cloud.visible
        half = self.width / 2 + 0.003
        self.in_pads = (np.abs(self.p[:, 0]) < half) & (np.abs(self.p[:, 1]) < gripper.pad_width_m / 2)
        self.in_pads &= (self.p[:, 2] <= 0) & (self.p[:, 2] > -gripper.pad_height_m)
        self.strip = (np.abs(self.p[:, 1]) < 0.011) & (np.abs(self.p[:, 0]) < gripper.max_width_m / 2)
        self.view, self.gripper, self.clouds = view, gripper, clouds

    def contacts(self, side):
        x = self.p[:, 0] * side
        edge = x[self.in_pads].max()
        return self.in_pads & (x > edge - 0.008) & (self.n[:, 0] * side >= -0.2)

    def aligned(self, side):
        return self.contacts(side) & (self.n[:, 0] * side > 0.87)


def by_sides(case, mask_of):
    return np.array([np.count_nonzero(mask_of(side)) for side in (-1, 1)])


def unknown_share(case, low, high, steps):
    axes = [a + (b - a) * (np.arange(s) + 0.5) / s for a, b, s in zip(low, high, steps)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    world = points @ case.T[:3, :3].T + case.T[:3, 3]
    index = case.view.volume.grid.index_of(world)
    inside = case.view.volume.grid.contains(index)
    seen = np.ones(len(world), dtype=bool)
    seen[inside] = case.view.volume.seen[tuple(index[inside].T)]
    return np.mean(~seen)


@pytest.fixture(scope="module")
def cases(planner, gripper):
    view = view_of_clutter(5, 9)
    found = planner.candidates(view.scene, view.volume, np.random.default_rng(0))
    clouds = build_clouds(view.scene, view.volume, TABLE_Z, CONFIG.clouds)
    pick = np.random.default_rng(3).permutation(len(found.grasps))[:120]
    return [Case(found, clouds, view, gripper, i) for i in pick]


def test_contact_counts(cases):
    for c in cases:
        row = c.row
        for name, mask_of in (("aligned", c.aligned), ("contacts", c.contacts)):
            everything = by_sides(c, mask_of)
            seen = by_sides(c, lambda side, m=mask_of, s=c.seen: m(side) & s)
            assert (row[f"all_{name}_min"], row[f"all_{name}_max"]) == (everything.min(), everything.max())
            assert (row[f"seen_{name}_min"], row[f"seen_{name}_max"]) == (seen.min(), seen.max())
        assert row["seen_between"] == np.count_nonzero(c.in_pads & c.seen)
        assert row["all_between"] == np.count_nonzero(c.in_pads)


def test_contact_shape(cases):
    for c in cases:
        sides = [c.contacts(side) for side in (-1, 1)]
        if not all(m.any() for m in sides):
            continue
        cosines = [np.mean(c.n[m, 0] * s) for m, s in zip(sides, (-1, 1))]
        assert c.row["alignment_min"] == pytest.approx(min(cosines), abs=1e-5)
        assert c.row["alignment_max"] == pytest.approx(max(cosines), abs=1e-5)
        assert c.row["contact_height_min"] == pytest.approx(min(np.ptp(c.p[m, 2]) for m in sides), abs=1e-6)
        assert c.row["contact_breadth_min"] == pytest.approx(min(np.ptp(c.p[m, 1]) for m in sides), abs=1e-6)
        behind = [np.mean(-c.p[m, 2]) for m in sides]
        assert c.row["contact_behind_tip"] == pytest.approx(np.mean(behind), abs=1e-6)
        assert c.row["contact_behind_tip_min"] == pytest.approx(min(behind), abs=1e-6)


def test_place_on_the_object(cases):
    for c in cases:
        row, p = c.row, c.p
        assert row["extent_y"] == pytest.approx(np.ptp(p[c.in_pads, 1]), abs=1e-6)
        assert row["extent_z"] == pytest.approx(np.ptp(p[c.in_pads, 2]), abs=1e-6)
        assert row["seen_width"] == pytest.approx(np.ptp(p[c.in_pads & c.seen, 0]), abs=1e-6)
        assert row["penetration"] == pytest.approx(-p[c.strip & c.seen, 2].min(), abs=1e-6)
        assert row["beyond_tips"] == pytest.approx(max(0.0, p[c.strip, 2].max()), abs=1e-6)
        beyond = c.strip & (p[:, 2] > 0)
        wider = np.ptp(p[beyond, 0]) - c.width if beyond.sum() > 1 else -c.width
        assert row["wider_beyond"] == pytest.approx(wider, abs=1e-6)
        for a, name in enumerate("xyz"):
            # Extents come from points that are outermost in one of 64 directions: a little short.
            assert np.ptp(p[:, a]) - 0.012 < row[f"object_{name}"] <= np.ptp(p[:, a]) + 1e-6
        assert row["off_center_x"] == pytest.approx(abs(p[:, 0].min() + p[:, 0].max()) / 2, abs=0.008)


def test_pose(cases, gripper):
    for c in cases:
        row, R, tip = c.row, c.T[:3, :3], c.T[:3, 3]
        middle = tip - gripper.pad_height_m / 2 * R[:, 2]
        arm = c.cloud.completion.center - middle
        assert row["lever"] == pytest.approx(np.linalg.norm(np.cross(arm, R[:, 0])), abs=1e-6)
        assert row["lever_level"] == pytest.approx(np.hypot(arm[0], arm[1]), abs=1e-6)
        assert row["mass_below"] == pytest.approx(-arm[2], abs=1e-6)
        assert row["closing_vertical"] == pytest.approx(abs(R[2, 0]), abs=1e-6)
        assert row["breadth_vertical"] == pytest.approx(abs(R[2, 1]), abs=1e-6)
        assert row["approach_down"] == pytest.approx(-R[2, 2], abs=1e-6)
        assert row["approach_view"] == pytest.approx(R[:, 2] @ c.cloud.completion.view, abs=1e-6)
        assert row["closing_view"] == pytest.approx(abs(R[:, 0] @ c.cloud.completion.view), abs=1e-6)
        assert row["tip_height"] == pytest.approx(tip[2] - TABLE_Z, abs=1e-6)
        assert row["tip_above_bottom"] == pytest.approx(tip[2] - c.cloud.points[:, 2].min(), abs=1e-6)
        assert row["top_above_tip"] == pytest.approx(c.cloud.seen[:, 2].max() - tip[2], abs=1e-6)
        assert row["width"] + row["width_margin"] == pytest.approx(gripper.max_width_m, abs=1e-6)


def test_unknown_space(cases, hand):
    opening, pad_y, pad_z, half_y, thickness, length = hand[:6]
    outer = opening / 2 + thickness
    for c in cases[:40]:
        steps = [max(1, int(np.ceil(d / 0.01))) for d in (outer - c.width / 2, 2 * half_y, length)]
        right = unknown_share(c, (c.width / 2, -half_y, -length), (outer, half_y, 0), steps)
        left = unknown_share(c, (-outer, -half_y, -length), (-c.width / 2, half_y, 0), steps)
        assert c.row["unknown_finger_max"] == pytest.approx(max(left, right), abs=1e-6)
        assert c.row["unknown_finger_mean"] == pytest.approx((left + right) / 2, abs=1e-6)
        assert c.row["unknown_finger_other"] <= c.row["unknown_finger_mean"] + 1e-6
        steps = [max(1, int(np.ceil(d / 0.01))) for d in (c.width, 2 * pad_y, pad_z)]
        between = unknown_share(c, (-c.width / 2, -pad_y, -pad_z), (c.width / 2, pad_y, 0), steps)
        assert c.row["unknown_between"] == pytest.approx(between, abs=1e-6)
        assert 0 <= c.row["unknown_palm"] <= 1


def test_points_of_others_near_the_fingers(cases, gripper):
    """Far points count nowhere; a point counts in at most one place."""
    for c in cases:
        others = in_grasp_frame(c.T, c.clouds.cells.points[c.clouds.cells.tags != c.own])
        names = ("foreign_fingers", "foreign_palm", "foreign_between", "foreign_near", "foreign_corridor")
        shift = tip_shift(gripper, gripper.max_width_m, c.width)
        reach = (np.abs(others[:, 0]) < 0.10) & (np.abs(others[:, 1]) < 0.052)
        reach &= (others[:, 2] < 0.013) & (others[:, 2] > shift - 0.30)
        assert sum(c.row[name] for name in names) <= np.count_nonzero(reach)


def test_object_features_of_a_box_under_another(planner):
    below, above = (
        standing_box(0, 0.62, -0.1, (0.07, 0.08, 0.06)),
        standing_box(1, 0.63, -0.1, (0.04, 0.04, 0.05), z=TABLE_Z + 0.06),
    )
    view = view_of(below, above)
    found = planner.candidates(view.scene, view.volume, np.random.default_rng(0))
    row = {i: found.features[found.grasps.object_ids == i][0] for i in (0, 1)}
    column = FEATURE_NAMES.index
    assert row[0][column("breadth")] == pytest.approx(0.08, abs=0.01)
    assert row[0][column("height")] == pytest.approx(0.06, abs=0.005)
    assert row[0][column("bottom_height")] == pytest.approx(0.0, abs=0.003)
    assert row[1][column("bottom_height")] == pytest.approx(0.06, abs=0.006)
    assert row[0][column("log_foreign_above")] > 3 > row[1][column("log_foreign_above")]
    assert min(r[column("log_foreign_touching")] for r in row.values()) > 1
    assert row[0][column("log_pixels")] > row[1][column("log_pixels")]
