"""The ZED by its SDK, against a double of that: this shows that torc's reading of the documentation is consistent."""

import sys
from types import ModuleType

import numpy as np
import pytest
from camera_scenes import COLOR, POSE, seen

from lab_helpers.fake_pyzed import ErrorCode, FakeSl
from torc.errors import CameraError, InputError, MissingDependencyError
from torc.testing.camera_conformance import check_camera
from torc_lab.cameras.zed_sdk import ZedCamera, ZedConfig

SEEN = seen(COLOR, POSE)


@pytest.fixture
def sl(monkeypatch):
    """The SDK's module."""
    module = FakeSl(SEEN.rgb, SEEN.depth_m.copy(), COLOR.K)
    package = ModuleType("pyzed")
    package.sl = module
    monkeypatch.setitem(sys.modules, "pyzed", package)
    monkeypatch.setitem(sys.modules, "pyzed.sl", module)
    return module


def test_it_keeps_the_rules(sl):
    with ZedCamera() as camera:
        check_camera(camera)


def test_a_snapshot_is_what_the_sdk_measured(sl):
    sl.depth[:10], sl.depth[10:20], sl.depth[20:30] = np.nan, np.inf, -np.inf
    o = ZedCamera(ZedConfig(pair=True)).capture()
    np.testing.assert_array_equal(o.rgb, SEEN.rgb)
    assert (o.depth_m[:30] == 0).all()
    np.testing.assert_array_equal(o.depth_m[30:], SEEN.depth_m[30:])
    np.testing.assert_array_equal(o.K, COLOR.K)
    assert (o.pair.baseline_m, o.stamp_s) == (0.12, 1.5)
    np.testing.assert_array_equal(o.pair.right, SEEN.rgb[..., 1])


def test_it_asks_for_metres_and_opencvs_axes(sl):
    ZedCamera(ZedConfig(serial=123, resolution="VGA", depth_mode="ULTRA", warm_up=0)).capture()
    wanted = sl.wanted
    assert (wanted.coordinate_units, wanted.coordinate_system) == ("METER", "IMAGE")
    assert (wanted.serial, wanted.camera_resolution, wanted.depth_mode) == (123, "VGA", "ULTRA")
    assert sl.log == ["open", "grab", "grab"]


def test_a_recording_ends(sl):
    sl.left = 1
    camera = ZedCamera(ZedConfig(file="seen.svo2"))
    camera.capture()
    assert sl.wanted.file == "seen.svo2"
    with pytest.raises(CameraError, match=r"END_OF_SVOFILE_REACHED; the recording is at its end"):
        camera.capture()
    assert sl.log[-1] == "close"


def test_what_cannot_be_opened_is_told(sl):
    sl.opens = ErrorCode.CAMERA_NOT_DETECTED
    with pytest.raises(CameraError, match=r"cannot be opened: .*CAMERA_NOT_DETECTED"):
        ZedCamera().capture()
    with pytest.raises(InputError, match="or no depth_mode 'MAGIC'"):
        ZedCamera(ZedConfig(depth_mode="MAGIC")).capture()
    with pytest.raises(InputError, match="no resolution '8K'"):
        ZedCamera(ZedConfig(resolution="8K")).capture()


def test_the_foreign_package_of_that_name_is_recognised(monkeypatch, tmp_path):
    for name in ("pyzed", "pyzed.sl"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    with pytest.raises(MissingDependencyError, match="Install it with: the ZED SDK"):
        ZedCamera().capture()
    (tmp_path / "pyzed.py").write_text("stranger = True\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingDependencyError, match=r"another project's.*pip uninstall pyzed"):
        ZedCamera().capture()
    monkeypatch.delitem(sys.modules, "pyzed", raising=False)
