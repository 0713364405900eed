"""`torc camera` as a user meets it: what a RealSense camera sees becomes a frame that `torc decide` decides for."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from lab_helpers.realsense_feeder import Lens, SoftwareRealSense
from tests.helpers.torc_command import run_torc
from torc.geometry.transforms import invert, look_at, make_pose, rotation_about
from torc.perception.stereo import made_up_pair
from torc.pipeline.frames import load_frame, save_observation
from torc.testing.contexts import box
from torc.testing.synthetic import SyntheticCylinder, synthetic_observation
from torc.workspace.description import CameraMount
from torc_lab.cameras import zed_uvc

SHAPES = (
    box(1, 0.62, -0.02, (0.07, 0.07, 0.12)),
    box(2, 0.60, -0.22, (0.08, 0.05, 0.09)),
    SyntheticCylinder(3, (0.74, -0.12, 1.05 + 0.07), 0.035, 0.14),
)
POSE = look_at((0.12, -0.1, 1.50), (0.64, -0.1, 1.09))
T_COLOR_DEPTH = make_pose(rotation_about([0, 1, 0], 0.004), [0.015, 0.0, 0.0])
LENS = Lens(640, 480, 600.0)


def seen(pose):
    return synthetic_observation(SHAPES, CameraMount(pose, 640, 480, float(2 * np.arctan(240 / 600))))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """What a RealSense camera sees of three things on a table, as librealsense records it."""
    pytest.importorskip("pyrealsense2", reason="pyrealsense2 is not installed", exc_type=ImportError)
    device = SoftwareRealSense(LENS, LENS, T_COLOR_DEPTH)
    rng = np.random.default_rng(0)
    depth_m = seen(POSE @ T_COLOR_DEPTH).depth_m
    depth_m = depth_m + rng.normal(0, 0.001, depth_m.shape) * depth_m**2
    depth = np.where(rng.random(depth_m.shape) < 0.01, 0, np.round(1000 * depth_m)).astype(np.uint16)
    device.pictures = {"depth": depth, "color": seen(POSE).rgb}
    return _recorded(device, tmp_path_factory.mktemp("recording"))


def _recorded(device, folder):
    try:
        device.record(folder / "seen.db3", 6)
        return folder / "seen.db3"
    except RuntimeError:  # older versions of librealsense
        device.record(folder / "seen.bag", 6)
        return folder / "seen.bag"


@pytest.mark.long
def test_a_cameras_picture_becomes_a_decision_without_masks_pose_or_table_height(recording, tmp_path, capsys):
    frames = tmp_path / "frames"
    camera = ("--camera", "realsense", "--camera.file", recording)
    code, out, err = run_torc("camera", "record", *camera, "--out", frames, "--count", 2, capsys=capsys)
    assert code == 0, err
    assert [line.split(":")[0] for line in out.splitlines()] == [
        str(frames / name) for name in ("frame_0001", "frame_0002")
    ]
    assert "0.450 m above the support (estimated" in out
    assert {p.name for p in (frames / "frame_0001").iterdir()} == {"rgb.png", "depth.png", "frame.json"}
    stored = json.loads((frames / "frame_0001" / "frame.json").read_text())
    assert stored["pose_estimated"]
    assert not {"support_z_m", "grid", "labels"} & set(stored)

    code, out, err = run_torc(
        *("decide", frames / "frame_0001", "--out", tmp_path / "answer", "--mark", "250,215"), capsys=capsys
    )
    assert code == 0, err
    assert "The camera's pose was estimated" in out
    assert "Objects in sight: 3." in out
    answer = json.loads((tmp_path / "answer" / "decision.json").read_text())
    assert answer["pose_estimated"]
    # The grasp is where the things are: in the estimated world, seen through the true one.
    T = POSE @ invert(np.array(stored["T_world_camera"]))
    grasp = T @ np.array(answer["grasps"][0]["T_world_tcp"])
    nearest = min(float(np.linalg.norm(grasp[:2, 3] - s.center[:2])) for s in SHAPES)
    assert nearest < 0.05
    assert 1.05 < grasp[2, 3] < 1.22

    code, _, err = run_torc("decide", frames / "frame_0001", "--robot", "sda10f_2f85", capsys=capsys)
    assert code == 2
    assert "pose was estimated from the picture" in err


def test_numbers_go_on_and_a_given_pose_is_stored(recording, tmp_path, capsys):
    pose = ",".join(map(str, POSE.ravel()))
    for _ in range(2):
        code, out, _ = run_torc(
            *("camera", "record", "--camera", "realsense", "--camera.file", recording, "--camera.pose", pose),
            *("--out", tmp_path, "--description", "the blue can"),
            capsys=capsys,
        )
        assert code == 0
    assert f"{tmp_path / 'frame_0002'}: 640x480 pixels" in out
    frame = load_frame(tmp_path / "frame_0002")
    assert not frame.pose_estimated
    assert frame.target_description == "the blue can"
    assert frame.support_z_m == pytest.approx(1.05, abs=0.003)
    np.testing.assert_allclose(frame.observation.T_world_camera, POSE)


def test_the_picture_shows_colour_depth_masks_and_what_was_not_seen(recording, tmp_path, capsys):
    file = tmp_path / "seen.png"
    code, out, _ = run_torc(
        *("camera", "show", "--camera", "realsense", "--camera.file", recording, "--out", file), capsys=capsys
    )
    assert code == 0
    assert "objects: 3" in out
    picture = cv2.imread(str(file))[..., ::-1]
    assert picture.shape == (480, 3 * 640 + 12, 3)
    np.testing.assert_array_equal(picture[:, :640], seen(POSE).rgb)
    assert not (picture[:, 1292:] == picture[:, :640]).all()


def test_a_camera_that_sees_no_support_shows_what_it_sees(tmp_path, capsys):
    """So that it can be turned to one."""
    pytest.importorskip("pyrealsense2", reason="pyrealsense2 is not installed", exc_type=ImportError)
    device = SoftwareRealSense(LENS, LENS, T_COLOR_DEPTH)
    steps = np.random.default_rng(0).integers(300, 2900, (480, 640)).astype(np.uint16)
    device.pictures = {"depth": steps, "color": np.full((480, 640, 3), 90, np.uint8)}
    camera = ("--camera", "realsense", "--camera.file", _recorded(device, tmp_path))
    code, out, _ = run_torc("camera", "show", *camera, "--out", tmp_path / "seen.png", capsys=capsys)
    assert code == 0
    assert "camera: its pose is not known" in out
    assert "no masks: No support was found in the picture" in out
    code, _, err = run_torc("camera", "record", *camera, "--out", tmp_path / "frames", capsys=capsys)
    assert code == 2
    assert "No support was found" in err


@pytest.mark.parametrize("depth", ["as-measured", "sgbm"])
def test_recorded_frames_that_show_no_support_are_shown_all_the_same(tmp_path, capsys, depth):
    """A bowl, which is level nowhere."""
    K, (rows, cols) = seen(POSE).K, np.mgrid[-1:1:480j, -1:1:640j]
    bowl = (0.9 - 0.3 * rows**2 - 0.3 * cols**2).astype(np.float32)
    pair = made_up_pair(bowl, float(K[0, 0]))
    pictures = {"left": pair.left, "right": pair.right, "baseline_m": pair.baseline_m}
    np.savez(tmp_path / "f.npz", rgb=np.full((480, 640, 3), 90, np.uint8), depth_m=bowl, K=K, **pictures)
    camera = ("--camera", "recorded", "--camera.path", tmp_path / "f.npz", "--depth", depth)
    code, out, _ = run_torc("camera", "show", *camera, "--out", tmp_path / "seen.png", capsys=capsys)
    assert code == 0
    assert "no masks: " in out
    assert (tmp_path / "seen.png").is_file()


@pytest.fixture
def frames(tmp_path):
    save_observation(tmp_path / "frames" / "frame_1", seen(POSE))
    return tmp_path / "frames"


def test_without_objects_the_picture_says_why(tmp_path, capsys):
    empty = synthetic_observation((), CameraMount(POSE, 640, 480, float(2 * np.arctan(240 / 600))))
    save_observation(tmp_path / "frames" / "frame_1", empty)
    recorded = ("--camera", "recorded", "--camera.path", tmp_path / "frames")
    code, out, _ = run_torc("camera", "show", *recorded, "--out", tmp_path / "seen.png", capsys=capsys)
    assert code == 0
    assert "no masks: The snapshot: nothing stands on the support" in out
    code, _, err = run_torc("camera", "record", *recorded, "--out", tmp_path / "more", capsys=capsys)
    assert code == 0
    assert "`torc decide` will refuse this frame" in err


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--camera", "simulated"), "sees only the simulation: `torc run` looks through it"),
        (("--camera", "realsens"), "Unknown camera 'realsens'. Did you mean 'realsense'"),
        (("--camera", "recorded"), "no recorded frames at ''"),
        (("--camera", "recorded", "--camera.pth", "x"), "camera.pth"),
        (("--camera", "recorded", "--camera.at-end", "jump"), "camera.at_end cannot be 'jump'"),
        (("--camera", "ros", "--camera.pose", "1,2"), "has 2 numbers, not 16"),
        (("--camera", "zed-uvc", "--camera.resolution", "8K"), "choose 2K, FHD, HD, VGA"),
    ],
)
def test_what_cannot_be_is_told(arguments, text, tmp_path, capsys):
    code, _, err = run_torc("camera", "record", *arguments, "--out", tmp_path, capsys=capsys)
    assert code == 2
    assert text in err


def test_a_stereo_pair_without_depth_needs_a_depth_stage(tmp_path, capsys, theirs):
    name = theirs(
        "capture(self)",
        "import numpy as np; from torc.records import Observation, StereoPair; "
        "grey = np.zeros((48, 64), np.uint8); K = np.array([[50., 0, 32], [0, 50, 24], [0, 0, 1]]); "
        "return Observation(np.zeros((48, 64, 3), np.uint8), np.zeros((48, 64), np.float32), K, np.eye(4), "
        "np.zeros(0), 0.0, pair=StereoPair(grey, grey, 0.1))",
    )
    code, _, err = run_torc("camera", "record", "--camera", name, "--out", tmp_path, capsys=capsys)
    assert code == 2
    assert "but a stereo pair: add --depth sgbm" in err


def test_depth_in_another_unit_is_refused_not_recorded(tmp_path, capsys, theirs):
    name = theirs(
        "capture(self)",
        "import numpy as np; from dataclasses import replace; from torc.testing.synthetic import "
        "synthetic_observation; o = synthetic_observation(()); return replace(o, depth_m=1000 * o.depth_m)",
    )
    code, _, err = run_torc("camera", "record", "--camera", name, "--out", tmp_path / "out", capsys=capsys)
    assert code == 2
    assert "the unit or scale of the depth is wrong" in err
    assert not (tmp_path / "out").exists()


def test_a_recorded_pair_is_matched_again(tmp_path, capsys):
    o = seen(POSE)
    save_observation(tmp_path / "frame", replace(o, pair=made_up_pair(o.depth_m, 600.0)))
    answers = []
    for depth in ("as-measured", "sgbm"):
        options = ("--depth", depth, "--json")
        code, out, err = run_torc("decide", tmp_path / "frame", *options, capsys=capsys)
        assert code == 0, err
        answers.append(json.loads(out[out.index("{") :]))
    pixels = [sum(found["pixels"] for found in answer["objects"]) for answer in answers]
    assert pixels[0] != pixels[1]
    assert pixels[0] == pytest.approx(pixels[1], rel=0.2)


def test_a_simulated_robot_sees_no_real_camera(frames, capsys):
    code, _, err = run_torc(
        *("run", "structured-01", "--camera", "recorded", "--camera.path", frames), capsys=capsys
    )
    assert code == 2
    assert "looks at the real world" in err


def test_the_kinds_are_listed_with_what_is_missing(monkeypatch, tmp_path, capsys):
    for number, name in ((0, "ZED 2i"), (10, "Webcam"), (9, "ZED 2i")):
        (tmp_path / f"video{number}").mkdir()
        (tmp_path / f"video{number}" / "name").write_text(f"{name}\n")
    monkeypatch.setattr(zed_uvc, "_VIDEO_DEVICES", tmp_path)
    code, out, _ = run_torc("camera", "list", capsys=capsys)
    assert code == 0
    assert "found: /dev/video0: ZED 2i\n" in out
    assert out.index("/dev/video9") < out.index("/dev/video10")
    code, out, _ = run_torc("camera", "list", "--json", capsys=capsys)
    found = {kind["name"]: kind for kind in json.loads(out)}
    assert set(found) == {"realsense", "zed-uvc", "zed", "ros", "recorded"}
    assert "ZED SDK" in found["zed"]["missing"]
    assert len(found["zed-uvc"]["devices"]) == 3
    assert found["recorded"] == {**found["recorded"], "missing": "", "devices": None}
