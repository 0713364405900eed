"""Ids over snapshots: what stays keeps its id, what moves or comes back gets it again, merges and splits are undone."""

from dataclasses import replace

import numpy as np
import pytest

from torc.perception.segmentation import PerceptionConfig, segment
from torc.perception.tracking import (
    Seen,
    TrackingConfig,
    _name_the_new,
    agreement,
    carried_over,
    same_ids,
    settled_masks,
)
from torc.records import BACKGROUND, MAX_OBJECTS, TARGET_ID, KnownObject
from torc.testing.contexts import box
from torc.testing.synthetic import random_clutter, synthetic_capture

CONFIG = TrackingConfig()


def look_of(shape_id):
    """What a shape looks like: a direction of its own."""
    return np.eye(64, dtype=np.float32)[shape_id]


class Eyes:
    """Tracks true masks, given in an order of their own each time."""

    def __init__(self, sure=0.9):
        self.scene, self.names, self.sure = None, {}, sure

    def see(self, shapes, order=1, join=(), cut=None, sure=None):
        """Ids by shape. `join`: shapes that are one mask; `cut`: one that falls into a left and a right mask."""
        capture = synthetic_capture(shapes)
        observation, truth = capture.observation, capture.label_image
        groups = [[s] for s in sorted({int(k) for k in np.unique(truth) if k >= 0}, reverse=order < 0)]
        if join:
            groups = [g for g in groups if g[0] not in join] + [list(join)]
        label = np.full(truth.shape, -1, np.int16)
        for i, group in enumerate(groups):
            label[np.isin(truth, group)] = i
        if cut is not None:
            cols = np.nonzero(truth == cut)[1]
            right = (truth == cut) & (np.arange(truth.shape[1]) > np.median(cols))
            label[right] = len(groups)
            groups.append([cut])
        sureness = np.full(len(groups), self.sure if sure is None else sure, np.float32)
        carried, before = None, self.scene
        if before is not None:
            carried = carried_over(before, observation, CONFIG)
            label, sureness = settled_masks(label, sureness, before, carried, CONFIG)
        found = segment(
            observation, np.where(label >= 0, label + 1, BACKGROUND).astype(np.int16), PerceptionConfig()
        )
        masks = [o.id - 1 for o in found.objects]
        shown = [np.bincount(truth[label == m]).argmax() for m in masks]
        seen = [
            Seen(o.points, look_of(int(s)), float(sureness[m]))
            for o, s, m in zip(found.objects, shown, masks)
        ]
        if before is None:
            overlap = np.zeros((len(seen), 0))
        else:
            overlap = agreement(int(label.max()) + 1, label, carried, before)[masks]
        ids, known = same_ids(seen, overlap, before, observation, CONFIG)
        table = np.full(MAX_OBJECTS + 1, BACKGROUND, np.int16)
        for o, k in zip(found.objects, ids):
            table[o.id] = k
        objects = tuple(sorted((replace(o, id=k) for o, k in zip(found.objects, ids)), key=lambda o: o.id))
        self.scene = replace(found, label_image=table[found.label_image], objects=objects, known=known)
        result = {}
        for s, k in zip(shown, ids):
            result.setdefault(int(s), []).append(k)
        return {s: k[0] if len(k) == 1 else k for s, k in result.items()}


A = box(1, 0.60, -0.20, (0.06, 0.06, 0.10))
B = box(2, 0.62, 0.00, (0.05, 0.08, 0.08))
C = box(3, 0.75, -0.10, (0.06, 0.06, 0.16))


def moved(shape, dx, dy):
    x, y, z = shape.center
    return replace(shape, center=(x + dx, y + dy, z))


def test_what_stays_keeps_its_id_whatever_the_order_of_the_masks():
    eyes = Eyes()
    first = eyes.see((A, B, C))
    assert len(set(first.values())) == 3
    assert TARGET_ID not in first.values()
    assert eyes.see((A, B, C), order=-1) == first
    assert eyes.see((B, C)) == {k: first[k] for k in (2, 3)}


def test_a_nudged_object_keeps_its_id():
    eyes = Eyes()
    first = eyes.see((A, B, C))
    assert eyes.see((moved(A, 0.01, 0.01), B, C)) == first
    assert eyes.see((moved(A, 0.01, 0.01), moved(B, 0.08, 0.05), C)) == first


def test_what_moved_to_where_another_stood_is_not_taken_for_it():
    eyes = Eyes()
    first = eyes.see((A, B, C))
    assert eyes.see((moved(A, 0.02, 0.2), C))[1] == first[1]


def test_masks_without_a_pixel_change_nothing():
    eyes = Eyes()
    eyes.see((A, B, C))
    seen = synthetic_capture((A, B, C))
    label = np.where(seen.label_image >= 0, seen.label_image - 1, -1).astype(np.int16)
    carried = carried_over(eyes.scene, seen.observation, CONFIG)
    sure = np.full(5, 0.5, np.float32)
    without = settled_masks(label, sure[:3], eyes.scene, carried, CONFIG)
    empty = settled_masks(label, sure, eyes.scene, carried, CONFIG)
    np.testing.assert_array_equal(empty[0], without[0])
    np.testing.assert_array_equal(empty[1][:3], without[1])
    found = agreement(5, label, carried, eyes.scene)
    np.testing.assert_array_equal(found[:3], agreement(3, label, carried, eyes.scene))
    assert not found[3:].any()


def test_what_was_hidden_for_a_while_comes_back_under_its_id():
    small, wall = box(5, 0.74, -0.1, (0.03, 0.03, 0.03)), box(6, 0.6, -0.1, (0.06, 0.2, 0.2))
    eyes = Eyes()
    first = eyes.see((small, A))
    behind = eyes.see((small, wall))
    assert 5 not in behind
    again = eyes.see((small, A))
    assert again[5] == first[5]


def test_what_is_new_gets_an_id_that_nobody_had():
    eyes = Eyes()
    first = eyes.see((A, B))
    second = eyes.see((B, C))
    assert second[3] not in first.values()


def test_what_is_gone_is_forgotten_and_its_id_is_free_again():
    eyes = Eyes()
    first = eyes.see((A, B))
    for _ in range(CONFIG.forget):
        eyes.see((B,))
    assert {k.id for k in eyes.scene.known} == {first[2]}
    assert eyes.see((B, C))[3] == first[1]


def test_two_objects_that_became_one_mask_are_parted_again():
    near = moved(B, 0.0, -0.14)
    eyes = Eyes()
    first = eyes.see((A, near, C))
    assert eyes.see((A, near, C), join=(1, 2), sure=0.5) == first


def test_one_object_that_fell_into_two_masks_is_joined_again():
    eyes = Eyes()
    first = eyes.see((A, B, C))
    assert eyes.see((A, B, C), cut=2, sure=0.5) == first


def test_the_surer_reading_counts_the_new_one_too():
    near = moved(B, 0.0, -0.14)
    eyes = Eyes(sure=0.5)
    eyes.see((A, near, C), join=(1, 2))
    later = eyes.see((A, near, C), sure=0.9)
    assert len(set(later.values())) == 3


@pytest.mark.parametrize("seed", range(4))
def test_over_a_whole_episode_no_id_is_lost_or_changed(seed):
    rng = np.random.default_rng(seed)
    shapes = list(random_clutter(rng, 12))
    shapes = [replace(s, id=s.id + 1) for s in shapes]
    eyes, ids, order = Eyes(), {}, 1
    while len(shapes) > 2:
        order = -order
        for shape, k in eyes.see(shapes, order).items():
            assert ids.setdefault(shape, k) == k
        assert len(set(ids.values())) == len(ids)
        shapes.pop(int(rng.integers(len(shapes))))
        at = int(rng.integers(len(shapes)))
        shapes[at] = moved(shapes[at], 0.006, -0.004)


def test_a_camera_that_moved_finds_the_same_surface():
    from torc.workspace.description import CameraMount
    from torc.workspace.workspace_files import load_workspace

    own = load_workspace().camera
    T = own.T_world_camera.copy()
    T[:3, 3] += [0.02, 0.03, 0.01]
    seen = synthetic_capture((A, B, C), CameraMount(T, own.width, own.height, own.vertical_fov_rad))
    eyes = Eyes()
    eyes.see((A, B, C))
    carried, truth = carried_over(eyes.scene, seen.observation, CONFIG), seen.label_image
    both = (carried >= 0) & (truth >= 0)
    assert both.sum() > 0.7 * (truth >= 0).sum()
    names = {o: np.bincount(truth[(carried == o) & (truth >= 0)]).argmax() for o in eyes.scene.ids}
    assert sorted(names.values()) == [1, 2, 3]


def test_the_target_out_of_sight_is_forgotten_last():
    look, points = np.eye(1, dtype=np.float32)[0], np.zeros((1, 3), np.float32)
    kept = [KnownObject(k, points, look, 1.0, missed=k, is_target=k == 63) for k in range(1, 64)]
    ids = [None, None]
    _name_the_new(ids, kept)
    assert ids == [62, 61]
    assert kept[0].id == 63


def test_sixty_three_ids_go_round():
    eyes = Eyes()
    for n in range(30):
        x = 0.5 + 0.01 * n
        shapes = tuple(
            replace(box(1, x, -0.4 + 0.1 * j, (0.05, 0.05, 0.06)), id=(3 * n + j) % 63 + 1) for j in range(3)
        )
        ids = eyes.see(shapes)
        assert len(set(ids.values())) == 3
        assert all(0 < k < MAX_OBJECTS for k in ids.values())
