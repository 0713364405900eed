"""Sorted things are of a few sorts, and each stands in the lane of its sort."""

import itertools

import numpy as np
import pytest

from torc.errors import InputError
from torc.generation.arrangements import StructuredConfig, structured_arrangement
from torc.generation.footprints import fits_on, footprint
from torc.generation.sampling import SORTS, lanes, sample_sorted, sort_of
from torc.objects.library import builtin_object_names, load_object, object_facts

SEEDS = range(4)


def test_every_sort_has_objects_of_all_its_kinds():
    kinds = {object_facts(name).kind for name in builtin_object_names()}
    assert set(itertools.chain(*SORTS.values())) <= kinds
    assert sort_of("soup_can_red") == "tins"
    assert sort_of("hammer_red") == ""


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("count", [8, 13, 20])
def test_a_sample_is_of_few_sorts_and_many_of_each(count, seed):
    names = sample_sorted(count, np.random.default_rng(seed), builtin_object_names())
    assert len(set(names)) == len(names) == count
    sorts = [sort_of(name) for name in names]
    assert "" not in sorts
    sizes = [len(list(group)) for _, group in itertools.groupby(sorts)]
    assert len(sizes) == len(set(sorts))  # one sort after the other
    assert min(sizes) >= 3


def test_without_anything_of_a_sort_there_is_no_sample():
    with pytest.raises(InputError, match="cupboard"):
        sample_sorted(4, np.random.default_rng(0), ["die_red"])


@pytest.mark.parametrize("seed", SEEDS)
def test_lanes_share_out_the_region(seed):
    rng, region = np.random.default_rng(seed), ((0.5, 0.8), (-0.3, 0.1))
    models = [load_object(name) for name in sample_sorted(12, rng, builtin_object_names())]
    found = dict(zip((sort_of(m.name) for m in models), lanes(models, region, rng)))
    assert all(x == region[0] for x, _ in found.values())
    spans = sorted(y for _, y in found.values())
    assert spans[0][0] == region[1][0]
    assert spans[-1][1] == pytest.approx(region[1][1])
    assert all(a[1] == pytest.approx(b[0]) for a, b in itertools.pairwise(spans))


@pytest.mark.parametrize("seed", SEEDS)
def test_sorted_things_stand_beside_their_like(seed):
    rng = np.random.default_rng(seed)
    names = sample_sorted(9, rng, builtin_object_names())
    config = StructuredConfig(region=((0.5, 0.86), (-0.42, 0.18)), margin_m=0.0, sorted=True, stacked=0.0)
    placed = structured_arrangement(names, rng, config)
    by_side = [sort_of(p.model) for p in sorted(placed, key=lambda p: p.position[1])]
    assert len(list(itertools.groupby(by_side))) == len(set(by_side))


@pytest.mark.parametrize("storeys", [2, 3])
def test_towers_are_as_high_as_allowed(storeys):
    names = ["tuna_can_blue"] * 4
    config = StructuredConfig(stacked=1.0, stacked_height_m=np.inf, storeys=storeys)
    placed = structured_arrangement(names, np.random.default_rng(0), config)
    heights = sorted({round(p.position[2], 4) for p in placed})
    assert len(heights) == storeys
    tin = footprint(load_object(names[0]), np.eye(3))
    assert fits_on(tin, tin, np.zeros(2), overhang_m=0.0)


@pytest.mark.parametrize("leaning", [0.0, 1.0])
def test_high_things_lean_where_wanted(leaning):
    names = ["cereal_box_yellow", "milk_carton_blue", "ball_red"]
    config = StructuredConfig(stacked=0.0, leaning=leaning, lying=0.0)
    placed = structured_arrangement(names, np.random.default_rng(1), config)
    tilted = [p.T_world_object[2, 2] < 0.99 for p in placed]
    high = [load_object(p.model).size_m[2] > 2 * load_object(p.model).size_m[0] for p in placed]
    assert tilted == [h and leaning == 1.0 for h in high]
    assert any(high)
