"""The compiled tests of points against boxes and voxels, each beside a plain enumeration."""

import numpy as np
import pytest

from torc.task_planning.belief.box_kernels import SPREAD, fit_shares, hider_masks, settle

FRAME = np.array([0.1, -0.2, 1.0, 0.02])
SHAPE = (20, 24, 15)


def random_boxes(rng: np.random.Generator, n: int) -> np.ndarray:
    """Boxes in and around the grid."""
    low, size = FRAME[:3], FRAME[3] * np.array(SHAPE)
    yaw = rng.uniform(0, np.pi, n)
    center = low + size * rng.uniform(-0.1, 1.1, (n, 3))
    return np.column_stack([center, rng.uniform(0.01, 0.07, (n, 3)), np.cos(yaw), np.sin(yaw)])


def points_of(box: np.ndarray) -> np.ndarray:
    steps = SPREAD * np.array([-1, 0, 1])
    u, v, w = (g.ravel() for g in np.meshgrid(*(steps * h for h in box[3:6]), indexing="ij"))
    R = np.array([[box[6], -box[7]], [box[7], box[6]]])
    return box[:3] + np.column_stack([np.column_stack([u, v]) @ R.T, w])


def inside(box: np.ndarray, points: np.ndarray, scale: float) -> np.ndarray:
    R = np.array([[box[6], box[7]], [-box[7], box[6]]])
    local = np.column_stack([(points - box[:3])[:, :2] @ R.T, (points - box[:3])[:, 2]])
    return (np.abs(local) <= scale * box[3:6]).all(axis=1)


def voxels(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    index = np.floor((points - FRAME[:3]) / FRAME[3]).astype(int)
    return index, ((index >= 0) & (index < SHAPE)).all(axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_shares_are_those_of_a_plain_count(seed):
    rng = np.random.default_rng(seed)
    poses, bodies, seen = random_boxes(rng, 40), random_boxes(rng, 6), rng.random(SHAPE) < 0.4
    found = fit_shares(poses, bodies, 0.85, seen, FRAME)
    for pose, (unseen, within) in zip(poses, found):
        points = points_of(pose)
        index, there = voxels(points)
        plain = np.zeros(27, bool)
        plain[there] = ~seen[tuple(index[there].T)]
        assert unseen == pytest.approx(plain.mean(), abs=1e-9)
        hit = np.any([inside(b, points, 0.85) for b in bodies], axis=0)
        assert within == pytest.approx(hit.mean(), abs=1e-9)
    assert 0 < found[:, 0].mean() < 1
    assert 0 < found[:, 1].mean() < 1


@pytest.mark.parametrize("layers", [True, False])
def test_masks_hold_the_voxels_hider_and_every_body_on_the_ray(layers):
    """The ray is sampled densely here; a body that it only grazes is left out of the comparison."""
    rng = np.random.default_rng(4)
    poses, bodies, seen = random_boxes(rng, 30), random_boxes(rng, 5), rng.random(SHAPE) < 0.3
    bits = np.array([1 << k for k in (1, 5, 31, 40, 63)], dtype=np.uint64)
    hidden_by = np.where(seen, 0, 1 << rng.integers(1, 60, SHAPE)).astype(np.uint64)
    eye, scale = np.array([0.0, 0.0, 1.5]), 0.9
    eye_scale = np.array([*eye, scale if layers else 0.0])
    masks, hidden = hider_masks(poses, bodies, bits, eye_scale, seen, hidden_by, FRAME)
    steps, compared = np.linspace(0, 1, 2001)[:, None], 0
    for n, pose in enumerate(poses):
        points = points_of(pose)
        index, there = voxels(points)
        for p in range(27):
            free = not there[p] or seen[tuple(index[p])]
            assert hidden[n, p] == (not free)
            if free:
                assert masks[n, p] == 0
                continue
            want, ray, sure = int(hidden_by[tuple(index[p])]), eye + steps * (points[p] - eye), True
            for body, bit in zip(bodies, bits):
                surely, maybe = inside(body, ray, scale - 0.02).any(), inside(body, ray, scale + 0.02).any()
                sure &= surely == maybe
                want |= int(bit) if layers and surely else 0
            if sure:
                compared += 1
                assert int(masks[n, p]) == want
    assert compared > 200


def test_a_pose_falls_onto_the_highest_body_below_it():
    table = np.array([0.5, 0.0, 1.05, 0.1, 0.1, 0.05, 1.0, 0.0])
    high = np.array([0.5, 0.0, 1.15, 0.02, 0.02, 0.05, 1.0, 0.0])
    bits = np.array([2, 8], dtype=np.uint64)
    rows = [(0.5, 0.0, 1.40), (0.58, 0.0, 1.40), (0.58, 0.0, 1.10), (0.9, 0.0, 1.40)]
    poses = np.array([[*row, 0.01, 0.01, 0.03, 1.0, 0.0] for row in rows])
    on = settle(poses, np.stack([table, high]), bits, 0.01)
    np.testing.assert_array_equal(on, [8, 2, 0, 0])
    np.testing.assert_allclose(poses[:, 2], [1.23, 1.13, 1.10, 1.40], atol=1e-12)
