"""Analytic scenes for the tests of this package."""

import numpy as np

from torc.testing.synthetic import SyntheticBox
from torc.workspace.workspace_files import load_workspace

WORKSPACE = load_workspace()
TABLE_Z = WORKSPACE.support_z_m


def standing_box(object_id, x, y, size, yaw=0.0, z=TABLE_Z) -> SyntheticBox:
    wxyz = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
    return SyntheticBox(object_id, (x, y, z + size[2] / 2), size, wxyz)
