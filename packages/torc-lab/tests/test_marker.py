"""By a marker on the table torc notices that the camera has moved since the calibration."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibration_rig import BOARD, ErringArm, K, Photographer, calibrated, held, lab  # noqa: F401
from torc.errors import InputError
from torc.geometry.transforms import make_pose
from torc_lab.calibration.hand_eye import solve_hand_eye
from torc_lab.calibration.marker import (
    find_marker,
    marker_of_file,
    marker_picture,
    marker_shift_m,
    placed_marker,
)
from torc_lab.checking import _drift
from torc_lab.protocols import LabError

# ruff: noqa: F811


@pytest.fixture
def marker_pose(lab):
    x, y, _ = lab.workspace.table.center
    return make_pose(np.eye(3), [x, y + 0.3, lab.workspace.support_z_m])


def test_a_camera_that_was_moved_since_is_noticed_by_the_marker(lab, held, marker_pose, tmp_path):
    album, camera = calibrated(lab, held, 1, 8, marker_pose)
    assert len(album.markers) >= 4
    found = solve_hand_eye(album.views, BOARD, album.K, "fixed")
    marker = placed_marker(album.markers, album.K, found.T_camera)
    path = tmp_path / "calibration.yaml"
    path.write_text(found.as_yaml(8, marker), encoding="utf-8")
    noted = marker_of_file(path)
    np.testing.assert_allclose(noted.corners, marker.corners, atol=1e-6)
    np.testing.assert_allclose(noted.corners.mean(axis=0), marker_pose[:3, 3], atol=0.02)

    def shift(T_world_camera):
        camera.T_world_camera = T_world_camera
        gray = cv2.cvtColor(camera.unplaced().rgb, cv2.COLOR_RGB2GRAY)
        return marker_shift_m(noted, gray, K, found.T_camera)

    true = camera.T_world_camera
    assert shift(true) < 0.001
    sideways = shift(true @ make_pose(np.eye(3), [0.006, 0, 0]))
    assert 0.004 < sideways < 0.008
    assert shift(true @ make_pose(Rotation.from_rotvec([0, 0.01, 0]).as_matrix(), [0, 0, 0])) > 0.003
    camera.T_world_marker = None
    assert shift(true) is None


def test_markers_that_say_nothing(tmp_path):
    assert find_marker(np.full((200, 300), 90, np.uint8)) is None
    assert placed_marker([], K, np.eye(4)) is None
    square = np.array([[0.0, 0], [50, 0], [50, 50], [0, 50]])
    with pytest.raises(LabError, match="moved while"):
        placed_marker([square + 300, square + 300, square + 310], K, np.eye(4))
    two = np.full((400, 800), 255, np.uint8)
    two[100:300, 100:300] = two[100:300, 500:700] = marker_picture(200)
    assert find_marker(two) is None
    path = tmp_path / "calibration.yaml"
    path.write_text("T_world_camera: 1\n", encoding="utf-8")
    assert marker_of_file(path) is None
    path.write_text("marker_corners: [[1, 2], [3]]\n", encoding="utf-8")
    with pytest.raises(InputError, match="marker_corners"):
        marker_of_file(path)


def test_checking_a_lab_warns_of_a_camera_that_has_moved(lab, held, marker_pose, tmp_path):
    T_flange_board, sight = held
    true = lab.workspace.camera.T_world_camera
    camera = Photographer(
        ErringArm(lab, sight.qpos), true, T_flange_board, np.random.default_rng(0), marker_pose
    )
    gray = cv2.cvtColor(camera.unplaced().rgb, cv2.COLOR_RGB2GRAY)
    marker = placed_marker([find_marker(gray)], K, true)
    path = tmp_path / "calibration.yaml"
    path.write_text(f"marker_corners: {marker.corners.tolist()}\n", encoding="utf-8")
    conditions = replace(lab.conditions, settings={**lab.conditions.settings, "camera.pose": str(path)})
    calibrated_lab = replace(lab, conditions=conditions)

    def told():
        return list(_drift(calibrated_lab, replace(camera.unplaced(), T_world_camera=true)))

    (good,) = told()
    assert good.good
    assert "mm from where" in good.text
    camera.T_world_camera = true @ make_pose(np.eye(3), [0.01, 0, 0])
    (bad,) = told()
    assert not bad.good
    assert "calibrate again" in bad.text
    camera.T_world_marker = None
    assert "not in sight" in told()[0].text
    path.write_text("T_world_camera: 1\n", encoding="utf-8")
    assert "noted no marker" in told()[0].text
    assert not list(_drift(lab, camera.unplaced()))
