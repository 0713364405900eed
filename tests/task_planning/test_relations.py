"""'behind' and 'below' on ray-cast scenes whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.records import SegmentedScene
from torc.records.graph import EdgeKind
from torc.task_planning.relation_kernels import nearby_labels
from torc.task_planning.relations import (
    RelationConfig,
    behind_candidates,
    dilation_radius_px,
    find_adjacencies,
    find_relations,
    needed_support,
)
from torc.testing.contexts import box, perceive
from torc.testing.synthetic import half_sizes, random_clutter
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

FULL_HD = replace(load_workspace().camera, width=1920, height=1080)
STANDARD = load_workspace().camera
STACK = (box(3, 0.65, -0.1, (0.14, 0.14, 0.06)), box(7, 0.66, -0.1, (0.06, 0.06, 0.06), on=0.06))
ROW = (box(3, 0.74, -0.1, (0.06, 0.06, 0.20)), box(7, 0.60, -0.1, (0.06, 0.08, 0.12)))


def pairs(scene: SegmentedScene, config: RelationConfig | None = None) -> set[tuple[int, str, int]]:
    return {(r.source, r.kind.value, r.target) for r in find_relations(scene, config)}


@pytest.mark.parametrize("mount", [STANDARD, FULL_HD], ids=["640x480", "1920x1080"])
def test_an_object_under_another_is_below_it(mount: CameraMount) -> None:
    assert pairs(perceive(STACK, mount)) == {(3, "below", 7)}


@pytest.mark.parametrize("mount", [STANDARD, FULL_HD], ids=["640x480", "1920x1080"])
def test_an_object_half_covered_by_another_is_behind_it(mount: CameraMount) -> None:
    assert pairs(perceive(ROW, mount)) == {(3, "behind", 7)}


def test_objects_apart_in_the_image_are_not_related() -> None:
    assert (
        pairs(perceive((box(1, 0.6, -0.2, (0.05, 0.05, 0.1)), box(2, 0.6, 0.1, (0.05, 0.05, 0.1))))) == set()
    )


def test_relations_follow_the_ids() -> None:
    """Swapping two ids swaps them in the relations, and nothing else."""
    swapped = tuple(replace(s, id=10 - s.id) for s in STACK)
    assert pairs(perceive(swapped, STANDARD)) == {(7, "below", 3)}


def test_the_top_of_a_stack_in_front_is_still_above() -> None:
    """The lower object is nearer on average, so depth alone gets it the wrong way round; 'below' corrects it."""
    shapes = (box(1, 0.62, -0.1, (0.20, 0.10, 0.08)), box(2, 0.69, -0.1, (0.05, 0.06, 0.05), on=0.08))
    scene = perceive(shapes, STANDARD)
    assert pairs(scene) == {(1, "below", 2)}
    assert [(r.source, r.target) for r in behind_candidates(find_adjacencies(scene))] in ([(1, 2)], [(2, 1)])


def test_stacks_in_clutter_are_found_and_nothing_else_is_below() -> None:
    found = expected = wrong = 0
    for seed in range(6):
        shapes = random_clutter(np.random.default_rng(seed), 15)
        scene = perceive(shapes, STANDARD)
        top = {s.id: np.add(s.center, (0, 0, half_sizes(s)[2])) for s in shapes}
        foot = {s.id: np.subtract(s.center, (0, 0, half_sizes(s)[2])) for s in shapes}
        stacked = {(a, b) for a in scene.ids for b in scene.ids if np.allclose(top[a], foot[b])}
        below = {(r.source, r.target) for r in find_relations(scene) if r.kind == EdgeKind.BELOW}
        found += len(below & stacked)
        expected += len(stacked)
        wrong += len(below - stacked)
    assert wrong <= 1
    assert found >= 0.5 * expected  # a wide object hides all of the top it stands on


def test_labels_nearby_are_those_of_dilated_masks(rng: np.random.Generator) -> None:
    label = np.repeat(np.repeat(rng.integers(-2, 5, (12, 16)), 4, axis=0), 4, axis=1).astype(np.int16)
    radius = 2.5
    offsets = np.array([(r, c) for r in range(-2, 3) for c in range(-2, 3) if r * r + c * c <= radius**2])
    known = np.uint64(0b11011)  # label 2 is not reported
    near = nearby_labels(label, known, offsets)
    for k in range(5):
        dilated = np.zeros(label.shape, dtype=bool)
        padded = np.pad(label == k, 2)
        for r, c in offsets:
            dilated |= padded[2 + r : 2 + r + label.shape[0], 2 + c : 2 + c + label.shape[1]]
        outside = dilated & (label != k) & bool(known >> np.uint64(k) & np.uint64(1))
        np.testing.assert_array_equal(
            ((near >> np.uint64(k)) & np.uint64(1)).astype(bool) & (label != k), outside
        )


def test_mean_depths_are_those_of_the_boundary() -> None:
    scene = perceive(ROW, STANDARD)
    (pair,) = find_adjacencies(scene)
    label, depth = scene.label_image, scene.observation.depth_m
    rows, cols = np.nonzero(label == 3)
    others = np.argwhere(label == 7)
    distance2 = ((np.stack([rows, cols], 1)[:, None] - others[None]) ** 2).sum(-1).min(1)
    edge = distance2 <= dilation_radius_px(480, RelationConfig()) ** 2
    assert pair.pixels[0] == edge.sum()
    assert pair.mean_depth_m[0] == pytest.approx(depth[rows[edge], cols[edge]].mean(), rel=1e-5)


def test_pixels_without_depth_do_not_count() -> None:
    scene = perceive(ROW, STANDARD)
    depth = scene.observation.depth_m.copy()
    depth[scene.label_image == 3] = 0
    assert find_adjacencies(replace(scene, observation=replace(scene.observation, depth_m=depth))) == ()


def test_numbers_scale_to_the_authors_own() -> None:
    config = RelationConfig()
    assert dilation_radius_px(1080, config) == 4
    assert dilation_radius_px(480, config) == 2
    assert needed_support(1080, config) == 50
    assert needed_support(480, config) == pytest.approx(9.9, abs=0.1)


def test_two_objects_below_each_other_are_not_below() -> None:
    """Each has a low part right in front of a high part of the other: no order can be told from that."""
    low, high = (0.06, 0.06, 0.05), (0.06, 0.06, 0.12)
    shapes = (
        box(1, 0.60, 0.00, low),
        box(2, 0.66, 0.00, high),
        box(2, 0.60, -0.15, low),
        box(1, 0.66, -0.15, high),
    )
    scene = perceive(shapes, STANDARD)
    (pair,) = find_adjacencies(scene)
    assert min(pair.below_support) > needed_support(480, RelationConfig())
    assert {kind for _, kind, _ in pairs(scene)} == {"behind"}


def test_below_needs_enough_support() -> None:
    scene = perceive(STACK, STANDARD)
    (relation,) = find_relations(scene)
    support = relation.evidence["below_support"]
    exact = RelationConfig(min_support=support * (1080 / 480) ** 2)
    assert pairs(scene, exact) == {(3, "behind", 7)}
    assert pairs(scene, replace(exact, min_support=0.99 * exact.min_support)) == {(3, "below", 7)}


def test_bad_sizes_are_refused() -> None:
    with pytest.raises(InputError):
        RelationConfig(closeness_m=0)
