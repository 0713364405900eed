"""The example camera sees the same surfaces, with fewer pixels."""

import numpy as np
import pytest

from coarse_camera import CoarseCamera
from torc.testing.camera_conformance import check_camera
from torc.testing.contexts import see
from torc.testing.synthetic import SyntheticBox, synthetic_capture

BOX = SyntheticBox(1, (0.62, -0.10, 1.10), (0.06, 0.08, 0.10))


class _Fixed:
    def capture(self):
        return synthetic_capture((BOX,))


def test_it_conforms():
    check_camera(CoarseCamera(_Fixed()))


@pytest.mark.parametrize("step", [1, 2, 3])
def test_points_stay_where_they_are(step):
    (seen,) = see(CoarseCamera(_Fixed(), step).capture()).objects
    corners = np.abs(seen.points - np.array(BOX.center)) - 0.5 * np.array(BOX.size)
    assert corners.max() < 0.002 * step
