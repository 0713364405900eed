"""The example workspace is read, and its camera sees the table."""

from pathlib import Path

import numpy as np

from torc import load_workspace


def test_it_is_read_as_written():
    workspace = load_workspace(Path(__file__).parent / "high_camera.yaml")
    assert workspace.name == "high camera"
    assert workspace.obstacles[0].name == "post"
    assert workspace.obstacles[0] in workspace.static_boxes()
    middle = np.array([*workspace.table.center[:2], workspace.support_z_m, 1.0])
    u, v, w = workspace.camera.K @ (np.linalg.inv(workspace.camera.T_world_camera) @ middle)[:3]
    assert 0 < u / w < workspace.camera.width
    assert 0 < v / w < workspace.camera.height
