"""Laws of the candidate generators."""

import numpy as np
import pytest
from grasping_scenes import TABLE_Z, standing_box

from torc.grasping.axes import approach_directions, grasp_frames, normal_clusters
from torc.grasping.clouds import build_clouds
from torc.grasping.config import CandidateConfig, CloudConfig
from torc.grasping.generators import GENERATORS, GeneratorInput, antipodal, propose_boxes, propose_slices
from torc.grasping.generators.boxes import upright_box
from torc.testing.synthetic import SyntheticBox, SyntheticCylinder, SyntheticSphere
from torc.testing.views import view_of

CONFIG = CandidateConfig()
SHAPES = {
    "box": standing_box(0, 0.65, -0.1, (0.05, 0.06, 0.12), yaw=0.4),
    "flat box": standing_box(0, 0.65, -0.1, (0.06, 0.07, 0.03)),
    "can": SyntheticCylinder(0, (0.65, -0.1, TABLE_Z + 0.06), 0.033, 0.12),
    "ball": SyntheticSphere(0, (0.65, -0.1, TABLE_Z + 0.035), 0.035),
}


def given_for(hand, *shapes):
    view = view_of(*shapes)
    clouds = build_clouds(view.scene, view.volume, TABLE_Z, CloudConfig())
    return GeneratorInput(clouds.objects[0], hand, clouds.forward, TABLE_Z, 0.005, 6, CONFIG)


@pytest.mark.parametrize("name", GENERATORS)
@pytest.mark.parametrize("shape", SHAPES)
def test_candidates_are_right_handed_frames_in_the_allowed_cone_above_the_table(name, shape, hand):
    given = given_for(hand, SHAPES[shape])
    found = GENERATORS[name](given, np.random.default_rng(1))
    assert 0 < len(found) <= CONFIG.max_raw
    assert np.allclose(np.swapaxes(found.Rs, 1, 2) @ found.Rs, np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(found.Rs), 1.0)
    assert np.all((found.widths_m >= 0) & (found.widths_m <= hand.max_width_m - CONFIG.spread_m + 1e-9))
    approach = found.Rs[:, :, 2]
    assert np.all(approach[:, 2] < 0.11)
    tilted = np.hypot(approach[:, 0], approach[:, 1]) > 0.5
    yaw = np.arctan2(approach[tilted, 1], approach[tilted, 0])
    assert np.all(np.abs(yaw) < CONFIG.max_yaw_rad + 1e-6)
    assert np.all(found.tips[:, 2] > TABLE_Z + 0.005 - 1e-9)


@pytest.mark.parametrize("name", GENERATORS)
def test_the_same_generator_state_gives_the_same_candidates(name, hand):
    given = given_for(hand, SHAPES["box"])
    a, b, c = (GENERATORS[name](given, np.random.default_rng(s)) for s in (7, 7, 8))
    assert np.array_equal(a.Rs, b.Rs)
    assert np.array_equal(a.tips, b.tips)
    assert np.array_equal(a.widths_m, b.widths_m)
    assert name == "boxes" or not np.array_equal(a.tips, c.tips)


@pytest.mark.parametrize("name", GENERATORS)
def test_a_box_is_closed_upon_across_its_faces(name, hand):
    """Closing axes within 3 degrees of the box's short axis: centred, and as wide as the box."""
    given = given_for(hand, standing_box(0, 0.62, -0.1, (0.09, 0.05, 0.12), yaw=0.3))
    found = GENERATORS[name](given, np.random.default_rng(0))
    across = np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    aligned = np.abs(found.Rs[:, :, 0] @ across) > np.cos(np.deg2rad(3.0))
    assert aligned.sum() >= 3
    offset = (found.tips[aligned] - np.array([0.62, -0.1, 0])) @ across
    inside = np.abs(found.tips[aligned, 2] - TABLE_Z - 0.06) < 0.05
    assert np.median(np.abs(offset[inside])) < 0.004
    assert np.median(np.abs(found.widths_m[aligned] - 0.05)) < 0.005


def test_slices_find_the_parts_of_what_is_too_wide(hand):
    """Two posts of one object, 12 cm apart: each is grasped alone."""
    posts = [standing_box(0, 0.6, y, (0.03, 0.03, 0.10)) for y in (-0.16, -0.04)]
    found = propose_slices(given_for(hand, *posts), np.random.default_rng(0))
    along_y = np.abs(found.Rs[:, 1, 0]) > 0.99
    assert along_y.sum() > 5
    centers = found.tips[along_y, 1]
    assert np.all(np.minimum(np.abs(centers + 0.16), np.abs(centers + 0.04)) < 0.006)
    assert {round(float(c), 1) for c in np.sign(centers + 0.1)} == {-1.0, 1.0}


def test_too_wide_boxes_get_no_box_grasps(hand):
    given = given_for(hand, standing_box(0, 0.65, -0.1, (0.11, 0.12, 0.1)))
    assert len(propose_boxes(given, np.random.default_rng(0))) == 0


def test_the_upright_box_of_a_box_is_that_box(rng):
    shape = SyntheticBox(0, (0.1, 0.2, 0.3), (0.04, 0.08, 0.10))
    half = np.array(shape.size) / 2
    yaw = 0.36651914  # a multiple of the search step
    points = rng.uniform(-half, half, (4000, 3))
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    axes, center, found = upright_box(points @ turn.T + np.array(shape.center))
    assert np.allclose(center, shape.center, atol=0.002)
    long = int(np.argmax(found[:2]))
    assert abs(axes[long] @ turn[:, 1]) > np.cos(np.deg2rad(4))
    assert np.allclose(np.sort(found[:2]), [0.02, 0.04], atol=0.003)


def test_approaches_lie_about_forward():
    forward = np.array([0.6, 0.8, 0.0])
    approaches = approach_directions(forward, CONFIG)
    assert len(approaches) == 1 + len(CONFIG.tilts_rad) * len(CONFIG.yaws_rad)
    assert np.allclose(np.linalg.norm(approaches, axis=1), 1.0)
    assert np.allclose(approaches[0], [0, 0, -1])
    assert np.all(approaches[1:] @ forward > 0)


def test_normal_clusters_of_a_corner_are_its_three_faces(rng):
    faces = np.repeat(np.eye(3), (60, 40, 20), axis=0)
    faces *= rng.choice([-1, 1], (120, 1))
    noisy = faces + rng.normal(0, 0.05, faces.shape)
    clusters = normal_clusters(noisy / np.linalg.norm(noisy, axis=1, keepdims=True), 6)
    assert len(clusters) == 3
    assert np.allclose(np.abs(clusters), np.eye(3), atol=0.05)


def test_frames_are_orthonormal_in_the_cone_and_keep_the_axes_of_the_faces(rng):
    forward = np.array([1.0, 0, 0])
    approaches = approach_directions(forward, CONFIG)
    c, s = np.cos(0.3), np.sin(0.3)
    faces = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    closings, turned, first = grasp_frames(
        approaches,
        rng.normal(size=(50, 3)),
        normal_clusters(faces.repeat(10, axis=0), 6),
        forward,
        forward,
        CONFIG,
    )
    assert np.allclose(np.linalg.norm(closings, axis=1), 1.0)
    assert np.allclose(np.linalg.norm(turned, axis=1), 1.0)
    assert np.allclose(np.einsum("ij,ij->i", closings, turned), 0.0, atol=1e-9)
    assert np.allclose(turned[:first], [0, 0, -1])
    on_a_face = np.max(np.abs(closings @ faces.T), axis=1) > 1 - 1e-9
    assert on_a_face.mean() > 0.2
    # Approaches are turned by 30 degrees at most.
    assert np.all(np.max(turned @ approaches.T, axis=1) > np.cos(np.deg2rad(30.1)))


def test_contacts_oppose_each_other_within_25_degrees_and_each_has_its_best_partner(rng):
    """The pairs of the antipodal generator, by brute force: a tilted ellipsoid with rough normals."""
    around = rng.normal(size=(160, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = around * (0.02, 0.03, 0.05) @ turn
    normals = around / (0.02, 0.03, 0.05) @ turn + rng.normal(0, 4.0, (160, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    pairs = antipodal._pairs(points, normals, np.arange(160), rng.integers(0, 160, 160), 0.085)

    way = points[None] - points[:, None]
    gap = np.linalg.norm(way, axis=-1)
    with np.errstate(invalid="ignore"):
        a, b = -np.einsum("ik,ijk->ij", normals, way) / gap, np.einsum("jk,ijk->ij", normals, way) / gap
    good = (a >= np.cos(np.deg2rad(25))) & (b >= np.cos(np.deg2rad(25))) & (gap > 0.004) & (gap <= 0.085)
    total = np.where(good, a + b, 0)
    assert set(pairs[:, 0]) == set(np.flatnonzero(total.max(axis=1) > 2 * np.cos(np.deg2rad(25)) + 1e-3))
    assert 20 < len(pairs) < 150
    for i, j in pairs:
        assert good[i, j]
        assert total[i, j] >= total[i].max() - 1.1e-3
