"""The RealSense adapter on librealsense's own software device, and on recordings that librealsense wrote."""

import sys

import cv2
import numpy as np
import pytest

rs = pytest.importorskip("pyrealsense2", reason="pyrealsense2 is not installed", exc_type=ImportError)

from camera_scenes import COLOR, DEPTH, POSE, T_COLOR_DEPTH, realsense, seen  # noqa: E402

from lab_helpers.realsense_feeder import Lens, SoftwareRealSense  # noqa: E402
from torc.errors import CameraError, InputError, MissingDependencyError  # noqa: E402
from torc.geometry.transforms import invert, project, unproject  # noqa: E402
from torc.perception.stereo import SgbmDepth, made_up_pair  # noqa: E402
from torc.testing.camera_conformance import check_camera  # noqa: E402
from torc_lab.cameras.realsense import RealSenseCamera, RealSenseConfig  # noqa: E402

QUICK = RealSenseConfig(warm_up=0)


def capture(device, config=QUICK):
    with RealSenseCamera(config, open_frames=device) as camera:
        return camera.capture()


def flat(depth_m):
    """Pixels away from edges, near enough to be the table."""
    steps = cv2.dilate(depth_m, np.ones((7, 7))) - cv2.erode(depth_m, np.ones((7, 7)))
    return (steps < 0.04) & (depth_m < 1.2)


def test_it_keeps_the_rules():
    with RealSenseCamera(QUICK, open_frames=realsense()) as camera:
        check_camera(camera)


def test_depth_is_what_the_colour_camera_would_measure():
    """Both pictures show a point at the same pixel, though two cameras with lenses of their own took them."""
    o, truth = capture(realsense()), seen(COLOR, POSE @ invert(T_COLOR_DEPTH))
    np.testing.assert_allclose(o.K, COLOR.K, atol=1e-4)
    np.testing.assert_array_equal(o.rgb, truth.rgb)
    read = flat(truth.depth_m) & (o.depth_m > 0)
    assert read.mean() > 0.3
    error = np.abs(o.depth_m - truth.depth_m)[read]
    # Readings are up to half a pixel away, which is 2 mm on a slanted table.
    assert np.median(error) < 0.001
    assert np.percentile(error, 99) < 0.003
    # Not what the depth camera measured: that is elsewhere in the picture.
    assert np.median(np.abs(seen(DEPTH, POSE).depth_m - truth.depth_m)[read]) > 0.01


def test_a_point_of_the_depth_camera_lands_where_the_colour_camera_sees_it():
    depth = seen(DEPTH, POSE).depth_m
    o = capture(realsense())
    inner = flat(depth)
    rows, cols = (a[::97] for a in np.nonzero(inner))
    points = unproject(rows, cols, depth[rows, cols].astype(float), DEPTH.K, np.eye(4))
    there_cols, there_rows, z = project(points, o.K, invert(T_COLOR_DEPTH))
    c, r = np.rint(there_cols).astype(int), np.rint(there_rows).astype(int)
    inside = (c >= 0) & (c < COLOR.width) & (r >= 0) & (r < COLOR.height)
    assert inside.sum() > 200
    error = np.abs(o.depth_m[r[inside], c[inside]] - z[inside])
    assert np.percentile(error, 95) < 0.005


@pytest.mark.parametrize("model", ["inverse_brown_conrady", "brown_conrady"])
def test_a_lens_with_distortion_gives_the_pinholes_picture(model):
    bent = Lens(*COLOR[:3], model, (0.25, 0.05, 0.02, -0.015, 0.0))
    device = SoftwareRealSense(DEPTH, bent, T_COLOR_DEPTH)
    truth = seen(COLOR, POSE @ invert(T_COLOR_DEPTH))
    rows, cols = np.mgrid[: COLOR.height, : COLOR.width]
    waves = [np.sin(cols / 4), np.sin(rows / 4), np.sin((rows + cols) / 5)]
    ideal = np.rint(128 + 100 * np.stack(waves, axis=-1)).astype(np.uint8)
    device.pictures = {**realsense().pictures, "color": _through(device, ideal)}
    o = capture(device)
    read = flat(truth.depth_m) & (o.depth_m > 0)
    read[:12], read[-12:], read[:, :12], read[:, -12:] = False, False, False, False
    error = np.abs(o.depth_m - truth.depth_m)[read]
    assert np.median(error) < 0.001
    assert np.percentile(error, 99) < 0.003
    middle = np.s_[20:-20, 20:-20]
    off = np.abs(o.rgb.astype(int) - ideal)[middle]
    assert np.median(off) < 3
    assert np.percentile(off, 99) < 12
    # As it came, the picture is off by pixels, of 25 levels each.
    assert np.percentile(np.abs(device.pictures["color"].astype(int) - ideal)[middle], 90) > 25


def _through(device, ideal):
    """What a lens makes of an ideal picture, by librealsense's deprojection of each of its pixels."""
    profile = device._profiles["color"].as_video_stream_profile().intrinsics
    rays = [
        rs.rs2_deproject_pixel_to_point(profile, [u, v], 1.0)[:2]
        for v in range(COLOR.height)
        for u in range(COLOR.width)
    ]
    x, y = np.moveaxis(np.reshape(rays, (COLOR.height, COLOR.width, 2)), -1, 0)
    K = COLOR.K
    places = ((x * K[0, 0] + K[0, 2]).astype(np.float32), (y * K[1, 1] + K[1, 2]).astype(np.float32))
    return cv2.remap(ideal, *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def test_the_unit_of_depth_is_the_devices():
    fine, coarse = capture(realsense(unit_m=0.0001)), capture(realsense(unit_m=0.001))
    read = flat(coarse.depth_m) & (fine.depth_m > 0) & (coarse.depth_m > 0)
    assert np.median(np.abs(fine.depth_m - coarse.depth_m)[read]) < 0.0006


def test_zero_is_no_reading():
    device = realsense()
    hole = device.pictures["depth"].copy()
    hole[80:140, 100:200] = 0
    device.pictures["depth"] = hole
    o = capture(device)
    assert (o.depth_m == 0).mean() > 0.03
    assert o.depth_m[o.depth_m > 0].min() > 0.3


def test_colours_are_red_first():
    device = realsense(format="bgr8")
    device.pictures["color"] = np.ascontiguousarray(device.pictures["color"][..., ::-1])
    np.testing.assert_array_equal(capture(device).rgb, capture(realsense()).rgb)


def infrared(infrared_lens=None):
    """A device whose infrared pictures show dots on what its depth shows."""
    device = realsense(baseline_m=0.05, infrared=infrared_lens)
    pair = made_up_pair(seen(DEPTH, POSE).depth_m, DEPTH.f, 0.05)
    device.pictures |= {"left": pair.left, "right": pair.right}
    return device


def test_the_infrared_pair_is_of_the_camera_that_depth_belongs_to():
    o, truth = capture(infrared(), RealSenseConfig(warm_up=0, infrared=True)), seen(DEPTH, POSE)
    np.testing.assert_allclose(o.K, DEPTH.K, atol=1e-4)
    np.testing.assert_allclose(o.depth_m, truth.depth_m, atol=0.00051)
    assert o.pair.baseline_m == pytest.approx(0.05)
    near = truth.depth_m < 1.2
    matched = SgbmDepth().measure(o).depth_m
    read = near & (matched > 0)
    assert read.sum() > 0.7 * near.sum()
    assert np.median(np.abs(matched - truth.depth_m)[read]) < 0.008  # .4 px of disparity
    # Colours belong to the same pixels, where the colour camera sees them.
    known = (o.rgb.sum(axis=2) > 0) & flat(truth.depth_m)
    assert known.mean() > 0.4
    assert np.median(np.abs(o.rgb.astype(int) - truth.rgb)[known]) <= 4


def test_infrared_pictures_of_another_camera_are_refused():
    device = infrared(Lens(320, 240, 250.0))
    with pytest.raises(CameraError, match="have not depth's size and intrinsics"):
        capture(device, RealSenseConfig(warm_up=0, infrared=True))


def test_it_is_opened_at_the_first_picture_warmed_up_once_and_closed():
    device = realsense()
    with RealSenseCamera(RealSenseConfig(warm_up=2, serial=12345), open_frames=device) as camera:
        assert device.log == []
        first, second = camera.capture(), camera.capture()
        assert device.log == ["open", "wait", "wait", "wait", "wait"]
    assert device.log[-1] == "close"
    assert second.stamp_s > first.stamp_s
    assert device.configs[0].serial == 12345
    camera.close()
    assert device.log.count("close") == 1


def test_after_a_failure_it_is_opened_anew():
    device = realsense()
    camera = RealSenseCamera(QUICK, open_frames=device)
    kept, device.pictures = device.pictures, {}
    with pytest.raises(CameraError, match="no picture"):
        camera.capture()
    device.pictures = kept
    assert camera.capture().depth_m.any()
    assert device.log == ["open", "wait", "close", "open", "wait"]
    camera.close()


def test_a_missing_stream_is_named():
    device = realsense()
    del device.pictures["depth"]
    with pytest.raises(CameraError, match="lack depth"):
        capture(device)
    with pytest.raises(CameraError, match=r"lack infrared 1, infrared 2.*--camera\.infrared"):
        capture(realsense(), RealSenseConfig(warm_up=0, infrared=True))


@pytest.mark.parametrize(("value", "text"), [(0, "depth is empty"), (65_000, "unit or scale")])
def test_depth_that_cannot_be_is_refused(value, text):
    device = realsense()
    device.pictures["depth"] = np.full((240, 320), value, np.uint16)
    with pytest.raises(InputError, match=f"RealSense: .*{text}"):
        capture(device)


def test_a_recording_is_read_by_the_real_pipeline_picture_by_picture_to_its_end(tmp_path):
    device = realsense(baseline_m=0.05)
    device.pictures |= {k: np.full((240, 320), 90, np.uint8) for k in ("left", "right")}
    path = _recorded(device, tmp_path)
    live = capture(realsense())
    with RealSenseCamera(RealSenseConfig(file=str(path), timeout_s=1.0)) as camera:
        first = camera.capture()
        assert (np.abs(first.depth_m - live.depth_m) > 1e-4).mean() < 1e-3  # extrinsics are stored as text
        np.testing.assert_array_equal(first.rgb, live.rgb)
        np.testing.assert_allclose(first.T_world_camera, live.T_world_camera, atol=1e-4)
        stamps = [first.stamp_s]
        with pytest.raises(CameraError, match="the recording is at its end"):
            stamps += iter(lambda: camera.capture().stamp_s, None)
        assert len(stamps) >= 2  # librealsense may leave out the first sets
        assert np.diff(stamps) == pytest.approx(0.033)
        # Opened anew; how many of the first sets librealsense leaves out then depends on the machine's load.
        assert camera.capture().stamp_s <= stamps[-1]


def _recorded(device, folder):
    """Recent versions of librealsense write .db3, older ones .bag."""
    try:
        device.record(folder / "seen.db3", 6)
        return folder / "seen.db3"
    except RuntimeError:
        device.record(folder / "seen.bag", 6)
        return folder / "seen.bag"


def test_no_recording_is_told(tmp_path):
    with pytest.raises(CameraError, match="There is no recording"):
        RealSenseCamera(RealSenseConfig(file=str(tmp_path / "none.bag"))).capture()
    (tmp_path / "text.bag").write_text("nothing")
    with pytest.raises(CameraError, match="no recording that can be read"):
        RealSenseCamera(RealSenseConfig(file=str(tmp_path / "text.bag"))).capture()


@pytest.mark.skipif(len(rs.context().query_devices()) > 0, reason="a RealSense camera is connected")
def test_no_device_is_told_with_what_to_do():
    with pytest.raises(CameraError, match=r"no camera is connected\. Plug it into a USB 3 port"):
        RealSenseCamera(QUICK).capture()


def test_without_the_library_its_remedy_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(MissingDependencyError, match="scripts/setup realsense"):
        RealSenseCamera(QUICK).capture()


@pytest.mark.parametrize("wrong", [{"width": 0}, {"warm_up": -1}, {"timeout_s": 0}])
def test_settings_are_checked(wrong):
    with pytest.raises(InputError, match="RealSenseConfig"):
        RealSenseConfig(**wrong)
