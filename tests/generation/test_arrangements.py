"""Arrangements are reproducible, free of overlaps, and where they should be; what is dropped hangs free."""

import numpy as np
import pytest

from torc.errors import InputError, UnknownNameError
from torc.generation.arrangements import (
    DROP_CENTER,
    DROP_FROM_Z_M,
    DROP_GAP_M,
    DROP_SIZE,
    StructuredConfig,
    bounding_radius,
    drop_arrangement,
    structured_arrangement,
)
from torc.generation.footprints import footprint, gaps
from torc.generation.sampling import sample_models
from torc.geometry.transforms import transform_points
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.settling import UNSEEN
from torc.sim.simulated_world import build_world
from torc.workspace.workspace_files import load_workspace

SEEDS = range(3)


def _outline(placement: ObjectPlacement) -> np.ndarray:
    """Points of the object's pieces, seen from above: vertices of visuals stand in for them."""
    vertices = np.concatenate([mesh.vertices for mesh in load_object(placement.model).visuals])
    return transform_points(placement.T_world_object, vertices)


@pytest.mark.parametrize("seed", SEEDS)
def test_structured_objects_touch_nothing_and_stay_in_the_region(seed: int) -> None:
    rng, config = np.random.default_rng(seed), StructuredConfig()
    placements = structured_arrangement(sample_models(11, rng), rng, config)
    problem = Problem("test", "structured", "", placements[0].name, tuple(placements))
    assert build_world(problem, None, load_workspace(), UNSEEN).data.ncon == 0
    (x0, x1), (y0, y1) = config.region
    margin = config.margin_m + 0.012  # what is stacked may stick out a little further
    for placement in placements:
        points = _outline(placement)
        assert (points[:, :2] > [x0 - margin, y0 - margin]).all()
        assert (points[:, :2] < [x1 + margin, y1 + margin]).all()
        assert points[:, 2].min() > config.support_z_m - 0.002


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


@pytest.mark.parametrize("seed", range(6))
def test_dropped_objects_are_apart_and_between_the_walls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    placements = drop_arrangement(sample_models(15, rng), rng)
    centers = np.array([p.position for p in placements])
    radii = np.array([bounding_radius(load_object(p.model)) for p in placements])
    apart = np.linalg.norm(centers[:, None] - centers[None], axis=2) - radii[:, None] - radii[None]
    assert apart[~np.eye(len(radii), dtype=bool)].min() >= DROP_GAP_M - 1e-9
    assert (centers[:, 2] - radii).min() >= DROP_FROM_Z_M - 1e-9
    inside = (
        np.abs(centers[:, :2] - DROP_CENTER) <= np.maximum(np.array(DROP_SIZE) / 2 - radii[:, None], 0) + 1e-9
    )
    assert inside.all()
    assert centers[:, 2].max() < DROP_FROM_Z_M + 1.0  # a fall from higher would scatter the heap
