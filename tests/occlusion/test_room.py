"""An object can be where it fits into what nobody has seen, and nowhere else."""

import numpy as np
import pytest

from torc.objects.library import load_object
from torc.occlusion.room import places_left

CAN = load_object("soup_can_red")  # 66 x 66 x 101 mm
VOXEL_M = 0.01


def _room(*size, grid=(40, 40, 40)):
    unseen = np.zeros(grid, dtype=bool)
    unseen[tuple(slice(5, 5 + n) for n in size)] = True
    return unseen


def test_where_everything_was_seen_it_is_nowhere():
    assert places_left(np.zeros((40, 40, 40), dtype=bool), CAN, VOXEL_M) == 0


@pytest.mark.parametrize("size", [(8, 8, 12), (12, 8, 8), (8, 12, 8)])
def test_it_fits_into_a_room_a_little_larger_than_itself_whichever_way_that_lies(size):
    assert places_left(_room(*size), CAN, VOXEL_M) > 0


@pytest.mark.parametrize("size", [(4, 30, 30), (30, 30, 4), (5, 5, 30), (8, 8, 6)])
def test_it_does_not_fit_into_a_room_that_is_too_thin_or_too_short(size):
    assert places_left(_room(*size), CAN, VOXEL_M) == 0


def test_more_room_has_at_least_as_many_places():
    counts = [places_left(_room(n, n, n), CAN, VOXEL_M) for n in (8, 11, 14, 20)]
    assert counts == sorted(counts)
    assert counts[-1] > counts[0]


def test_two_small_rooms_are_no_large_one():
    unseen = _room(8, 8, 5) | np.roll(_room(8, 8, 5), 15, axis=2)
    assert places_left(unseen, CAN, VOXEL_M) == 0


@pytest.mark.parametrize("name", ["notebook_black", "spoon_steel", "die_red"])
def test_thin_and_small_things_are_something_too(name):
    assert places_left(_room(30, 30, 30), load_object(name), VOXEL_M) > 0
    assert places_left(_room(1, 1, 1), load_object("notebook_black"), VOXEL_M) == 0
