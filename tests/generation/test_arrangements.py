"""Arrangements are reproducible, free of overlaps, and where they should be."""

import mujoco
import numpy as np
import pytest

from tests.helpers.mujoco_scene import mujoco_scene
from torc.errors import InputError, UnknownNameError
from torc.generation.arrangements import StructuredConfig, structured_arrangement
from torc.generation.footprints import footprint, gaps
from torc.generation.sampling import sample_models
from torc.geometry.transforms import transform_points
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement

SEEDS = range(6)


def _outline(placement: ObjectPlacement) -> np.ndarray:
    """Points of the object's pieces, seen from above: vertices of visuals stand in for them."""
    vertices = np.concatenate([mesh.vertices for mesh in load_object(placement.model).visuals])
    return transform_points(placement.T_world_object, vertices)


@pytest.mark.parametrize("seed", SEEDS)
def test_structured_objects_touch_nothing_and_stay_in_the_region(seed: int) -> None:
    rng, config = np.random.default_rng(seed), StructuredConfig()
    placements = structured_arrangement(sample_models(11, rng), rng, config)
    model = mujoco_scene(placements, config.support_z_m, False)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    (x0, x1), (y0, y1) = config.region
    margin = config.margin_m + 0.012  # what is stacked may stick out a little further
    for placement in placements:
        points = _outline(placement)
        assert (points[:, :2] > [x0 - margin, y0 - margin]).all()
        assert (points[:, :2] < [x1 + margin, y1 + margin]).all()
        assert points[:, 2].min() > config.support_z_m - 0.002


@pytest.mark.parametrize("seed", SEEDS)
def test_footprints_do_not_overlap_and_clutter_is_tight(seed: int) -> None:
    from scipy.spatial import ConvexHull, distance

    rng, config = np.random.default_rng(seed), StructuredConfig(stacked=0.0)
    placements = structured_arrangement(sample_models(10, rng), rng, config)
    outlines = [_outline(p)[:, :2] for p in placements]
    outlines = [o[ConvexHull(o).vertices] for o in outlines]
    dense = [
        np.concatenate([a + t * (np.roll(a, -1, axis=0) - a) for t in np.linspace(0, 1, 20)])
        for a in outlines
    ]
    nearest = np.full((10, 10), np.inf)
    for i in range(10):
        for j in range(10):
            if i != j:
                nearest[i, j] = distance.cdist(dense[i], dense[j]).min()
                planes = ConvexHull(outlines[j]).equations
                assert not (dense[i] @ planes[:, :2].T + planes[:, 2] < 0).all(axis=1).any()
    # pieces and visuals may differ by a millimetre or two
    assert nearest.min() > config.gap_m[0] - 0.003
    assert np.median(nearest.min(axis=1)) < config.gap_m[1] + 0.01


def test_stacked_things_lie_on_others() -> None:
    rng, config = np.random.default_rng(0), StructuredConfig(stacked=1.0)
    names = [
        "cracker_box_red",
        "sugar_box_white",
        "book_blue",
        "soup_can_yellow",
        "matchbox_red",
        "die_white",
    ]
    placements = structured_arrangement(names, rng, config)
    lowest = np.array([_outline(p)[:, 2].min() - config.support_z_m for p in placements])
    assert (lowest > 0.01).sum() >= 2


def test_tall_objects_tend_to_the_front() -> None:
    names = [
        "cereal_box_purple",
        "milk_carton_blue",
        "spray_can_red",
        "tuna_can_blue",
        "die_white",
        "toy_brick_red",
    ]
    config = StructuredConfig(tall_in_front=1.0, stacked=0.0, lying=0.0)
    x = [
        [p.position[0] for p in structured_arrangement(names, np.random.default_rng(s), config)]
        for s in range(10)
    ]
    tall, low = np.mean(np.array(x)[:, :3]), np.mean(np.array(x)[:, 3:])
    assert low - tall > 0.03


def test_too_many_objects_are_refused() -> None:
    with pytest.raises(InputError, match="do not fit"):
        structured_arrangement(
            ["cereal_box_yellow"] * 20, np.random.default_rng(0), StructuredConfig(restarts=2)
        )
    with pytest.raises(UnknownNameError):
        structured_arrangement(["nothing"], np.random.default_rng(0))


def test_gaps_are_a_lower_bound_and_exact_for_discs() -> None:
    disc = footprint(load_object("soup_can_red"), np.eye(3))
    at = np.array([[0.1, 0.0], [0.0, 0.05], [0.07, 0.07]])
    found = gaps(disc.extents, at, disc.extents[None], np.zeros((1, 2)))[:, 0]
    exact = np.linalg.norm(at, axis=1) - 0.066
    assert (found <= exact + 1e-12).all()
    np.testing.assert_allclose(found, exact, atol=0.001)
