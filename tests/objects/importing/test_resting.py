"""Things are set down on what they can stand on."""

import numpy as np
import pytest
from mesh_files import SIZE, revolved
from trimesh.creation import box as solid_box

from torc.geometry.transforms import rotation_about
from torc.objects.importing.resting import is_round, resting_rotation


def box(size: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """The corners of a box about a place."""
    return solid_box(size).vertices + np.array(at)


BOX = box(SIZE)
BALL = revolved(
    [(0.0, -0.04), *((0.04 * np.cos(a), 0.04 * np.sin(a)) for a in np.linspace(-1.4, 1.4, 15)), (0.0, 0.04)]
).vertices
CAN = revolved([(0.0, 0.0), (0.033, 0.0), (0.033, 0.1), (0.0, 0.1)], 32).vertices
CONE = revolved([(0.0, 0.0), (0.04, 0.1), (0.0, 0.1)], 32).vertices
"""On its tip."""


@pytest.mark.parametrize("angle", [0.0, 0.1, 0.5, -0.6])
def test_a_leaning_box_is_set_upright(angle: float) -> None:
    R = rotation_about((0.6, 0.8, 0.0), angle)
    turned = BOX @ R.T @ resting_rotation([BOX @ R.T]).T
    np.testing.assert_allclose(np.ptp(turned, axis=0)[2], 0.21, atol=1e-9)
    np.testing.assert_allclose(turned, BOX, atol=1e-9)  # and no more than that


def test_the_weight_decides() -> None:
    """A lamp: upright as long as its foot reaches far enough."""
    pole = box((0.02, 0.02, 0.3), (0.0, 0.0, 0.15))
    foot, head = box((0.1, 0.1, 0.02)), box((0.08, 0.08, 0.06))
    above, over = np.array([0.0, 0.0, 0.3]), np.array([0.09, 0.0, 0.3])
    np.testing.assert_allclose(resting_rotation([pole, foot, head + above]), np.eye(3))
    assert not np.allclose(resting_rotation([pole, foot, head + over]), np.eye(3), atol=0.1)


@pytest.mark.parametrize(("points", "round_"), [(BALL, True), (CAN, True), (CONE, True), (BOX, False)])
def test_round_things_are_round(points: np.ndarray, round_: bool) -> None:
    for R in (np.eye(3), rotation_about((0.0, 0.6, 0.8), 0.4)):
        assert is_round([points @ R.T]) == round_
