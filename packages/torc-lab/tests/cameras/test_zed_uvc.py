"""A ZED without SDK: calibration files, rectification against brute-force projection, depth of a known scene."""

import cv2
import numpy as np
import pytest
from zed_scene import (
    BOX,
    HEIGHT,
    R_RIGHT_LEFT,
    T_M,
    WIDTH,
    calibration_text,
    hits,
    raw_pixels,
    side_by_side,
    write_calibration,
)

from torc.errors import CameraError, InputError
from torc.perception.stereo import SgbmDepth
from torc.testing.camera_conformance import check_camera
from torc_lab.cameras import zed_uvc
from torc_lab.cameras.zed_uvc import Rectifier, ZedUvcCamera, ZedUvcConfig, read_calibration


@pytest.fixture(scope="module")
def raw():
    return side_by_side()


@pytest.fixture
def film(raw, tmp_path):
    """A film of three pictures, which OpenCV reads as it reads a device, and settings for it."""
    for k in range(3):
        cv2.imwrite(str(tmp_path / f"picture{k}.png"), raw)
    return ZedUvcConfig(
        device=str(tmp_path / "picture%d.png"),
        calibration=str(write_calibration(tmp_path)),
        resolution="VGA",
    )


def test_the_file_is_read_as_opencv_takes_it(tmp_path):
    (K, _), (_, lens), R_right_left, t_m = read_calibration(write_calibration(tmp_path), "VGA")
    np.testing.assert_allclose(R_right_left, R_RIGHT_LEFT, atol=1e-9)
    np.testing.assert_allclose(t_m, T_M, atol=1e-9)
    assert lens.tolist() == [-0.165, 0.021, -0.0006, 0.0004, 0.001]
    assert (K[0, 0], K[1, 2]) == (351.2, 193.1)


def test_rectified_points_are_where_they_are_projected(tmp_path):
    """Dots, painted where the raw lenses show some points, are found in one row, as far apart as depth says."""
    rectifier = Rectifier(write_calibration(tmp_path), "VGA")
    for point in ([0, 0, 0.7], [-0.2, -0.1, 0.6], [0.25, 0.12, 0.8], [0.2, -0.15, 0.7], [-0.1, 0.2, 1.1]):
        p = np.array([point], float)
        pictures = [_dot(*raw_pixels(p, side)[0]) for side in ("left", "right")]
        (u, v), (u_right, v_right) = map(_middle, rectifier.rectify(*pictures))
        turned = rectifier.R_rectified_left @ p[0]
        expected = rectifier.K @ turned / turned[2]
        assert (u, v) == pytest.approx(expected[:2], abs=0.05)
        assert v_right == pytest.approx(v, abs=0.05)
        assert rectifier.K[0, 0] * rectifier.baseline_m / (u - u_right) == pytest.approx(turned[2], rel=0.002)
    assert rectifier.baseline_m == pytest.approx(np.linalg.norm(T_M))


def _dot(u, v):
    rows, cols = np.mgrid[:HEIGHT, :WIDTH]
    return np.rint(250 * np.exp(-((cols - u) ** 2 + (rows - v) ** 2) / 18)).astype(np.uint8)


def _middle(picture):
    rows, cols = np.mgrid[:HEIGHT, :WIDTH]
    weight = picture.astype(float)
    return (weight * cols).sum() / weight.sum(), (weight * rows).sum() / weight.sum()


def test_the_scene_has_the_depth_that_it_has(film):
    with ZedUvcCamera(film) as camera:
        o = camera.capture()
        assert not o.depth_m.any()
        measured = SgbmDepth().measure(o).depth_m
    truth = _depth(o.K, Rectifier(film.calibration, "VGA").R_rectified_left)
    read = (measured > 0) & (truth < 1.6)
    assert read.mean() > 0.6
    error = np.abs(measured - truth)[read]
    assert np.median(error) < 0.003
    assert np.percentile(error, 90) < 0.015
    # The box stands before the table.
    assert (np.abs(truth - BOX[0][2]) < 0.02).mean() > 0.02


def _depth(K, R_rectified_left):
    """Of the rectified left camera, by tracing each of its pixels."""
    rows, cols = np.mgrid[:HEIGHT, :WIDTH]
    rays = np.stack([(cols - K[0, 2]) / K[0, 0], (rows - K[1, 2]) / K[1, 1], np.ones(cols.shape)], axis=-1)
    points = hits(np.zeros(3), rays.reshape(-1, 3) @ R_rectified_left)
    return (points @ R_rectified_left[2]).reshape(HEIGHT, WIDTH)


def test_colour_is_of_the_left_picture_red_first(film):
    o = ZedUvcCamera(film).capture()
    middle = o.rgb[150:250, 250:400].astype(int)
    assert np.abs(middle[..., 0] + middle[..., 2] - 255).max() < 12
    assert np.median(middle[..., 1] - 0.9 * middle[..., 2]) == pytest.approx(0, abs=1)


def test_its_pose_comes_from_depth_that_is_made_for_that(film):
    o = ZedUvcCamera(film).capture()
    assert o.pose_estimated
    # The table: its normal, and its distance.
    R = Rectifier(film.calibration, "VGA").R_rectified_left
    np.testing.assert_allclose(o.T_world_camera[2, :3], R @ [0, -0.6, -0.8], atol=0.02)
    assert o.T_world_camera[2, 3] == pytest.approx(0.80, abs=0.01)


def test_it_keeps_the_rules(film):
    with ZedUvcCamera(film) as camera:
        check_camera(camera)


def test_a_film_ends_and_is_shown_anew(film):
    camera = ZedUvcCamera(film)
    for _ in range(3):
        camera.capture()
    with pytest.raises(CameraError, match=r"gave no picture\. The film is at its end"):
        camera.capture()
    assert camera.capture().pair is not None


def test_of_a_device_old_pictures_are_dropped(raw, film):
    class Device:
        def __init__(self):
            self.log = []

        def grab(self):
            self.log.append("grab")

        def read(self):
            self.log.append("read")
            return True, raw

        def release(self):
            self.log.append("release")

    device = Device()
    config = ZedUvcConfig(0, film.calibration, "VGA", warm_up=2)
    with ZedUvcCamera(config, open_video=lambda config: device) as camera:
        camera.capture()
        camera.capture()
    assert device.log == ["grab"] * 2 + ["read"] + ["grab"] * 5 + ["read", "release"]


def test_another_cameras_calibration_is_found_out(film, tmp_path):
    write_calibration(tmp_path, stereo={"RX_VGA": 0.02})
    with pytest.raises(
        InputError, match=r"the same points are .* rows apart. Is the calibration this camera's"
    ):
        ZedUvcCamera(film).capture()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"left": {"k3": None}}, "No option 'k3' in section: 'LEFT_CAM_VGA'.*not taken for 0"),
        ({"stereo": {"RX_VGA": None}}, "(?i)No option 'RX_VGA'"),
        ({"stereo": {"TY_VGA": None}}, "(?i)No option 'TY_VGA'"),
        ({"stereo": {"Baseline": 0.12}}, "Baseline of 0.12 mm cannot be"),
        ({"stereo": {"CV_VGA": 8.5}}, "turned by 8.50 rad"),
        ({"left": {"fx": "wide"}}, "no complete calibration of a ZED: .*'wide'"),
        ({"left": {"cx": 900}}, "do not fit pictures of 672x376"),
    ],
)
def test_calibrations_that_lack_something_are_refused(tmp_path, changes, text):
    with pytest.raises(InputError, match=text):
        read_calibration(write_calibration(tmp_path, **changes), "VGA")


def test_calibrations_that_are_none_are_refused(tmp_path):
    with pytest.raises(InputError, match="No section: 'LEFT_CAM_HD'"):
        read_calibration(write_calibration(tmp_path), "HD")
    (tmp_path / "SN1.conf").write_text("<html>not found</html>")
    with pytest.raises(InputError, match="no complete calibration"):
        read_calibration(tmp_path / "SN1.conf", "VGA")
    with pytest.raises(InputError, match="missing"):
        read_calibration(tmp_path / "SN2.conf", "VGA")


def test_keys_without_a_resolution_do_for_the_shifts_alone(tmp_path):
    text = calibration_text().replace("TY_VGA", "TY").replace("TZ_VGA", "tz")
    (tmp_path / "SN1.conf").write_text(text)
    np.testing.assert_allclose(read_calibration(tmp_path / "SN1.conf", "VGA")[3], T_M, atol=1e-9)


def test_the_only_calibration_is_found(monkeypatch, tmp_path):
    monkeypatch.setattr(zed_uvc, "_PLACES", (str(tmp_path), str(tmp_path / "none")))
    with pytest.raises(InputError, match=r"None was found. Give --camera\.calibration"):
        zed_uvc.find_calibration("")
    (tmp_path / "SN1.conf").touch()
    assert zed_uvc.find_calibration("") == tmp_path / "SN1.conf"
    (tmp_path / "SN2.conf").touch()
    with pytest.raises(InputError, match="2 were found"):
        zed_uvc.find_calibration("")


def test_a_camera_of_another_kind_is_refused(film, tmp_path):
    cv2.imwrite(str(tmp_path / "picture0.png"), np.zeros((480, 640, 3), np.uint8))
    with pytest.raises(CameraError, match=r"shape \(480, 640, 3\); a ZED gives both"):
        ZedUvcCamera(film).capture()
    none = ZedUvcConfig(str(tmp_path / "none.avi"), film.calibration, "VGA")
    with pytest.raises(CameraError, match="there is no video device"):
        ZedUvcCamera(none).capture()
    with pytest.raises(InputError, match="choose 2K, FHD, HD, VGA"):
        ZedUvcConfig(resolution="4K")
