"""Calibrations from what was recorded elsewhere, and finished ones of easy_handeye."""

import json

import cv2
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from test_calibration import BOARD, T_BASE_CAMERA, T_FLANGE_BOARD, K, error_ahead_m, views
from torc.errors import InputError
from torc.geometry.transforms import invert, make_pose, wxyz_from_rotation
from torc_lab.calibration.board import pose_views
from torc_lab.calibration.hand_eye import solve_hand_eye, solve_samples
from torc_lab.calibration.stored import PoseFrame, samples_of_easy_handeye, views_of_pictures
from torc_lab.cameras.poses import read_pose
from torc_lab.cli.calibration import CalibrateCommand
from torc_lab.lab_file import example_labs, load_lab


def ros(T):
    w, x, y, z = map(float, wxyz_from_rotation(T[:3, :3]))
    place = dict(zip("xyz", map(float, T[:3, 3]), strict=True))
    return {"translation": place, "rotation": {"x": x, "y": y, "z": z, "w": w}}


def flat(T):
    nested = ros(T)
    return {**nested["translation"], **{f"q{k}": v for k, v in nested["rotation"].items()}}


def calibration(version, on_hand=False, tracking="camera_color_optical_frame", base="world"):
    about = {"robot_base_frame": base, "robot_effector_frame": "tool0", "tracking_base_frame": tracking}
    if version == 1:
        return {"parameters": {"eye_on_hand": on_hand, **about}, "transformation": flat(T_BASE_CAMERA)}
    kind = "eye_in_hand" if on_hand else "eye_on_base"
    return {"parameters": {"calibration_type": kind, **about}, "transform": ros(T_BASE_CAMERA)}


def stored(path, content):
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


@pytest.mark.parametrize(("version", "suffix"), [(1, "yaml"), (2, "calib")])
def test_a_finished_calibration_of_easy_handeye_is_a_camera_pose(version, suffix, tmp_path, workspace):
    path = stored(tmp_path / f"c.{suffix}", calibration(version))
    np.testing.assert_allclose(read_pose(str(path), workspace), T_BASE_CAMERA, atol=1e-9)


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"on_hand": True}, "on the hand"),
        ({"tracking": "camera_link"}, "optical frame"),
        ({"base": "base_link"}, "robot_base_frame 'base_link'"),
    ],
)
def test_a_calibration_whose_frames_do_not_fit_is_refused(version, wrong, message, tmp_path, workspace):
    path = stored(tmp_path / "c.yaml", calibration(version, **wrong))
    with pytest.raises(InputError, match=message):
        read_pose(str(path), workspace)


@pytest.mark.parametrize(
    "broken", [{"transformation": {}}, {"transform": {"rotation": 3}}, {"transformation": {"x": "a"}}]
)
def test_a_broken_calibration_is_refused(broken, tmp_path, workspace):
    about = calibration(1)["parameters"]
    with pytest.raises(InputError):
        read_pose(str(stored(tmp_path / "c.yaml", {"parameters": about, **broken})), workspace)


def test_a_camera_on_the_hand_is_no_camera_pose(tmp_path, workspace):
    found = solve_hand_eye(views(np.random.default_rng(0), 8, "hand"), BOARD, K, "hand")
    path = tmp_path / "calibration.yaml"
    path.write_text(found.as_yaml(8), encoding="utf-8")
    assert "T_tool0_camera" in path.read_text()
    with pytest.raises(InputError, match="T_tool0_camera"):
        read_pose(str(path), workspace)


@pytest.mark.parametrize("mounting", ["fixed", "hand"])
def test_samples_of_easy_handeye_give_the_calibration(mounting, tmp_path):
    seen = pose_views(views(np.random.default_rng(1), 12, mounting), BOARD, K)
    robot = [invert(v.T_base_flange) if mounting == "fixed" else v.T_base_flange for v in seen]
    samples = [{"robot": ros(F), "tracking": ros(v.T_camera_board)} for F, v in zip(robot, seen, strict=True)]
    path = stored(tmp_path / "s.samples", {"parameters": {}, "samples": samples})
    found = solve_samples(samples_of_easy_handeye(path, mounting, PoseFrame()), mounting)
    assert error_ahead_m(found.T_camera, T_BASE_CAMERA if mounting == "fixed" else T_FLANGE_BOARD) < 0.003
    samples[3]["tracking"]["translation"]["z"] = -0.1
    with pytest.raises(InputError, match="optical frame"):
        samples_of_easy_handeye(stored(path, {"samples": samples}), mounting, PoseFrame())


def pictured(path, facing):
    to_board = np.array([[1 / 4000, 0, 0.5 / 4000], [0, 1 / 4000, 0.5 / 4000], [0, 0, 1]])
    H = K @ facing[:3, [0, 1, 3]] @ to_board
    gray = cv2.warpPerspective(BOARD.picture(4000), H, (1280, 720), borderValue=90, flags=cv2.INTER_AREA)
    cv2.imwrite(str(path), gray)


def flanges_of_pictures(folder, count=8):
    """Writes pictures of a board in the hand, and returns where the flange was at each."""
    rng, flanges = np.random.default_rng(2), []
    for k in range(count):
        turn = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3)).as_matrix()
        facing = make_pose(turn, [*rng.uniform(-0.14, -0.06, 2), rng.uniform(0.45, 0.6)])
        pictured(folder / f"{k}.png", facing)
        flanges.append(T_BASE_CAMERA @ facing @ invert(T_FLANGE_BOARD))
    return flanges


@pytest.mark.parametrize("form", ["csv", "json", "yaml"])
def test_pictures_with_a_list_of_poses_calibrate(form, tmp_path, workspace):
    flanges = flanges_of_pictures(tmp_path)
    entries = [{"picture": f"{k}.png", **flat(T)} for k, T in enumerate(flanges)]
    path = tmp_path / f"poses.{form}"
    if form == "csv":
        lines = [",".join(entries[0])] + [",".join(map(str, e.values())) for e in entries]
        path.write_text("\n".join(lines), encoding="utf-8")
    elif form == "json":
        path.write_text(json.dumps({"poses": entries}), encoding="utf-8")
    else:
        parts = [
            {"position": T[:3, 3].tolist(), "wxyz": wxyz_from_rotation(T[:3, :3]).tolist()} for T in flanges
        ]
        entries = [{"picture": f"{k}.png", **part} for k, part in enumerate(parts)]
        path.write_text(yaml.safe_dump({"poses": entries}), encoding="utf-8")
    numbers = (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    out = tmp_path / "calibration.yaml"
    command = CalibrateCommand(
        lab_file(tmp_path, "sda10f-ros1"), out, poses_file=path, pictures=tmp_path, intrinsics=numbers
    )
    assert command.run() == 0
    assert error_ahead_m(read_pose(str(out), workspace), T_BASE_CAMERA) < 0.001


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no list of 1 to 1000 entries"),
        ("x,y\n1,2\n", "needs picture"),
        ("picture,x\na.png,1\n", "need position"),
    ],
)
def test_a_list_that_says_too_little_is_refused(text, message, tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        views_of_pictures(path, tmp_path, BOARD, PoseFrame())


def test_options_that_do_not_fit_are_refused(tmp_path):
    lab = tmp_path / "lab.yaml"
    for wrong, message in (
        ({"poses_file": lab}, "belong together"),
        ({"frame": "base"}, "--poses-file and --samples"),
        ({"poses": 3}, "too few"),
    ):
        with pytest.raises(InputError, match=message):
            CalibrateCommand(lab, tmp_path / "c.yaml", **wrong).run()


def lab_file(folder, name):
    path = folder / "lab.yaml"
    path.write_text(example_labs()[name], encoding="utf-8")
    return path


UPSIDE = make_pose(np.diag([-1.0, -1, 1]), np.zeros(3))


@pytest.mark.parametrize(
    ("options", "words", "turn"),
    [
        ({}, "x 0.150, y -0.330, z 1.000 m of the world frame, turned by 180", np.eye(4)),
        ({"base_turn_deg": 180.0}, "z 1.000 m of the world frame, turned by 0 degrees", UPSIDE),
        ({"frame": "world"}, "the world frame", None),
    ],
)
def test_samples_are_in_the_base_of_a_robot_that_does_not_stand_at_the_origin(
    options, words, turn, tmp_path, workspace, capsys
):
    """The UR5e stands on a pedestal, turned by 180 degrees; base_link of ROS is turned once more."""
    seen = pose_views(views(np.random.default_rng(1), 12, "fixed"), BOARD, K)
    samples = [{"robot": ros(invert(v.T_base_flange)), "tracking": ros(v.T_camera_board)} for v in seen]
    path, lab = stored(tmp_path / "s.samples", {"samples": samples}), lab_file(tmp_path, "ur5e-rtde")
    out = tmp_path / "c.yaml"
    assert CalibrateCommand(lab, out, samples=path, **options).run() == 0
    T_world_base = np.eye(4) if turn is None else load_lab(lab).robot.arm.T_world_base @ turn
    T_world_camera = T_world_base @ T_BASE_CAMERA
    assert error_ahead_m(read_pose(str(out), workspace), T_world_camera) < 0.003
    printed = capsys.readouterr().out
    assert words in printed
    assert f"The camera is at x {T_world_camera[0, 3]:.2f}" in printed


def test_listed_poses_say_their_frame_where_base_and_world_differ(tmp_path, workspace):
    flanges = flanges_of_pictures(tmp_path)
    entries = [{"picture": f"{k}.png", **flat(T)} for k, T in enumerate(flanges)]
    path, lab = stored(tmp_path / "p.yaml", {"poses": entries}), lab_file(tmp_path, "panda-ros2")
    numbers, out = (K[0, 0], K[1, 1], K[0, 2], K[1, 2]), tmp_path / "c.yaml"
    given = {"poses_file": path, "pictures": tmp_path, "intrinsics": numbers}
    with pytest.raises(InputError, match="--frame base"):
        CalibrateCommand(lab, out, **given).run()
    assert CalibrateCommand(lab, out, **given, frame="base").run() == 0
    T_world_base = load_lab(lab).robot.arm.T_world_base
    assert error_ahead_m(read_pose(str(out), workspace), T_world_base @ T_BASE_CAMERA) < 0.001
    named = [{"picture": f"{k}.png", "T_world_tool0": T.tolist()} for k, T in enumerate(flanges)]
    stored(path, {"poses": named})
    assert CalibrateCommand(lab, out, **given).run() == 0
    assert error_ahead_m(read_pose(str(out), workspace), T_BASE_CAMERA) < 0.001
