"""Where the camera is, to a millimetre, from twenty pictures of a board; and what is wrong is said."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from torc.errors import InputError
from torc.geometry.transforms import intrinsics, invert, look_at, make_pose
from torc.records import Observation
from torc.robots.kinematics import tool0_poses
from torc_lab.calibration.board import Board, BoardView, FoundCorners
from torc_lab.calibration.hand_eye import check_views, error_at, solve_hand_eye
from torc_lab.calibration.printing import write_board
from torc_lab.calibration.session import Session, collect_views
from torc_lab.cameras.poses import read_pose
from torc_lab.protocols import LabError

K = intrinsics(1280, 720, 0.8)
BOARD = Board()
T_BASE_CAMERA = look_at(np.array([0.1, 0.0, 0.6]), np.array([0.7, 0.0, 0.1]))
T_FLANGE_BOARD = make_pose(Rotation.from_euler("xyz", [0.05, -0.1, 0.4]).as_matrix(), [-0.1, -0.07, 0.03])
ARM_RAD, ARM_M = np.deg2rad(0.07), 0.0008
"""How far an arm is from where it says it is."""


def jiggled(T, rng, turn=ARM_RAD, shift=ARM_M):
    return T @ make_pose(
        Rotation.from_rotvec(rng.normal(0, turn / np.sqrt(3), 3)).as_matrix(),
        rng.normal(0, shift / np.sqrt(3), 3),
    )


def seen(T_camera_board, rng, noise_px=0.2, board=BOARD):
    p = board.corners @ T_camera_board[:3, :3].T + T_camera_board[:3, 3]
    pixels = np.column_stack([K[0, 0] * p[:, 0] / p[:, 2] + K[0, 2], K[1, 1] * p[:, 1] / p[:, 2] + K[1, 2]])
    return FoundCorners(np.arange(len(p)), pixels + rng.normal(0, noise_px, pixels.shape))


def views(rng, count=20, mounting="fixed", board=BOARD, turn=0.6, axes=3):
    """The board about .7 m in front of the camera, turned up to +-35 degrees."""
    found = []
    for _ in range(count):
        spin = rng.uniform(-turn, turn, 3) * (np.arange(3) < axes)
        facing = make_pose(
            Rotation.from_euler("xyz", [*spin]).as_matrix() @ np.diag([1.0, -1, -1]), [0, 0, 0]
        )
        facing[:3, 3] = [*rng.uniform(-0.12, 0.08, 2), rng.uniform(0.55, 0.8)]
        if mounting == "fixed":
            T_base_flange = T_BASE_CAMERA @ facing @ invert(T_FLANGE_BOARD)
        else:  # the same two transforms with the roles of camera and board changed
            T_base_flange = T_BASE_CAMERA @ invert(T_FLANGE_BOARD @ facing)
        found.append(BoardView(jiggled(T_base_flange, rng), seen(facing, rng, board=board)))
    return found


def error_ahead_m(T, true):
    """How far a point .7 m ahead of the camera is off."""
    point = np.array([0.0, 0.0, 0.7, 1.0])
    return float(np.linalg.norm((T @ point - true @ point)[:3]))


@pytest.mark.long
@pytest.mark.parametrize("mounting", ["fixed", "hand"])
def test_twenty_poses_give_a_millimetre_and_a_half(mounting):
    """The median of some trials, with the errors of an arm and of corners; held-out poses say about as much."""
    errors, promised = [], []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        found = solve_hand_eye(views(rng, mounting=mounting), BOARD, K, mounting)
        true = T_BASE_CAMERA if mounting == "fixed" else T_FLANGE_BOARD
        errors.append(error_ahead_m(found.T_camera, true))
        promised.append(found.error_m)
        assert abs(found.scale - 1) < 0.01
        assert found.rms_px < 3
    assert np.median(errors) < 0.0015
    assert 0.0002 < np.median(promised) < 0.0015


def test_exact_pictures_give_the_exact_answer():
    rng = np.random.default_rng(1)
    exact = []
    for view in views(rng, 8):
        board_in_camera = invert(T_BASE_CAMERA) @ view.T_base_flange @ T_FLANGE_BOARD
        exact.append(BoardView(view.T_base_flange, seen(board_in_camera, rng, 0.0)))
    found = solve_hand_eye(exact, BOARD, K, "fixed")
    np.testing.assert_allclose(found.T_camera, T_BASE_CAMERA, atol=1e-6)
    np.testing.assert_allclose(found.T_board, T_FLANGE_BOARD, atol=1e-6)
    assert found.error_m < 1e-6


def test_one_bad_picture_hardly_counts():
    rng = np.random.default_rng(2)
    good = views(rng)
    wrong = replace(good[3], T_base_flange=jiggled(good[3].T_base_flange, rng, 0.1, 0.05))
    found = solve_hand_eye([*good[:3], wrong, *good[4:]], BOARD, K, "fixed")
    assert error_ahead_m(found.T_camera, T_BASE_CAMERA) < 0.004
    assert found.errors_m.argmax() == 3


def test_a_board_of_another_size_is_noticed():
    rng = np.random.default_rng(3)
    printed = Board(square_m=0.0291, marker_m=0.0213)  # a printer that fits it to the page
    with pytest.raises(LabError, match=r"seem to be 29\.\d+ mm wide, not 30"):
        solve_hand_eye(views(rng, board=printed), BOARD, K, "fixed")


def test_a_camera_that_was_moved_is_noticed():
    rng = np.random.default_rng(4)
    found = solve_hand_eye(views(rng), BOARD, K, "fixed")
    now = views(rng, 6)
    before = np.median([error_at(v, (found.T_camera, found.T_board), BOARD, K, "fixed") for v in now])
    moved = jiggled(found.T_camera, rng, 0.01, 0.01)
    after = np.median([error_at(v, (moved, found.T_board), BOARD, K, "fixed") for v in now])
    assert before < 0.0015 < 0.004 < after


def test_pictures_that_tell_too_little_are_refused():
    rng = np.random.default_rng(5)
    with pytest.raises(LabError, match="too few"):
        solve_hand_eye(views(rng, 5), BOARD, K, "fixed")
    for little in (views(rng, 10, turn=0.05), views(rng, 10, axes=1)):
        with pytest.raises(LabError, match="turned too little"):
            check_views([v.T_base_flange for v in little])


def test_the_printed_board_is_found_in_a_picture_and_in_a_mirror_it_is_said(rng):
    flat = BOARD.picture(8000)
    h, w = flat.shape
    corners = np.array([[300, 200], [900, 260], [860, 620], [320, 560]], np.float32)
    H = cv2.getPerspectiveTransform(np.array([[0, 0], [w, 0], [w, h], [0, h]], np.float32), corners)
    picture = cv2.warpPerspective(flat, H, (1280, 720), borderValue=128, flags=cv2.INTER_AREA)
    found = BOARD.find(picture)
    assert found is not None
    assert len(found.ids) == 24
    true = cv2.perspectiveTransform((BOARD.corners[None, :, :2] * 8000).astype(np.float32), H)[0]
    assert np.abs(found.pixels - true[found.ids]).max() < 1.5
    with pytest.raises(LabError, match="mirrored"):
        BOARD.find(np.ascontiguousarray(picture[:, ::-1]))
    assert BOARD.find(np.full((200, 300), 90, np.uint8)) is None


@pytest.mark.parametrize("wrong", [{"columns": 2}, {"square_m": 30.0, "marker_m": 22.0}, {"marker_m": 0.03}])
def test_boards_that_are_none(wrong):
    with pytest.raises(InputError):
        Board(**wrong)


class Photographer:
    """A camera that sees the printed board in the hand of an arm, which a person brings from pose to pose; at some of
    them the board is covered.
    """

    def __init__(self, arm, poses, covered=()):
        self.arm, self.poses, self.covered, self.taken = arm, poses, covered, -1
        facing = make_pose(np.eye(3), [-0.1, -0.07, 0.6])  # z away from who looks
        flange = tool0_poses(arm, arm.rest_qpos[None])[0]
        self.T_world_camera = flange @ T_FLANGE_BOARD @ invert(facing)

    def brought_on(self, question):
        self.taken += 1
        return self.taken < len(self.poses)

    def qpos(self):
        return self.poses[self.taken]

    def unplaced(self):
        T = invert(self.T_world_camera) @ tool0_poses(self.arm, self.qpos()[None])[0] @ T_FLANGE_BOARD
        flat = BOARD.picture(4000)
        flat = np.full_like(flat, 90) if self.taken in self.covered else flat
        # A pixel's middle is at half a pixel of the print.
        to_board = np.array([[1 / 4000, 0, 0.5 / 4000], [0, 1 / 4000, 0.5 / 4000], [0, 0, 1]])
        H = K @ T[:3, [0, 1, 3]] @ to_board
        gray = cv2.warpPerspective(flat, H, (1280, 720), borderValue=90, flags=cv2.INTER_AREA)
        rgb = np.repeat(gray[..., None], 3, axis=-1)
        return Observation(rgb, np.ones(gray.shape, np.float32), K, np.eye(4), np.zeros(0), 0.0)


def test_a_person_calibrates_pose_by_pose(robot, rng, tmp_path, workspace):
    poses = robot.arm.rest_qpos + rng.uniform(-0.2, 0.2, (16, 7)) * [0.3, 0.3, 0.3, 0.3, 1.5, 1.5, 2.5]
    camera, told = Photographer(robot.arm, poses, covered=(2,)), []
    session = Session(camera, camera.qpos, robot.arm, BOARD, 12, camera.brought_on, told.append)
    collect_views(session)
    views_, found_K = session.views, session.K
    assert len(views_) == 12
    assert session.size == (1280, 720)
    assert session.markers == []
    assert "The board is not in sight, or too little of it." in told
    found = solve_hand_eye(views_, BOARD, found_K, "fixed")
    assert error_ahead_m(found.T_camera, camera.T_world_camera) < 0.001
    path = tmp_path / "calibration.yaml"
    path.write_text(found.as_yaml(len(views_)), encoding="utf-8")
    np.testing.assert_allclose(read_pose(str(path), workspace), found.T_camera, atol=1e-6)


def test_too_few_pictures_are_refused(robot):
    camera = Photographer(robot.arm, robot.arm.rest_qpos + np.zeros((3, 1)))
    with pytest.raises(InputError, match="too few"):
        collect_views(Session(camera, camera.qpos, robot.arm, BOARD, 12, camera.brought_on, print))


@pytest.mark.parametrize("suffix", ["pdf", "png"])
def test_the_page_has_the_size_that_it_says(suffix, tmp_path):
    path = tmp_path / f"board.{suffix}"
    write_board(BOARD, path, dpi=100)
    if suffix == "pdf":
        assert b"/MediaBox [ 0 0 841." in path.read_bytes()
    else:
        with Image.open(path) as page:
            assert page.size == (1169, 827)
            found = BOARD.find(np.asarray(page))
        assert found is not None
        across = np.ptp(found.pixels[:, 0]) / 100 * 0.0254
        assert across == pytest.approx(np.ptp(BOARD.corners[:, 0]), abs=0.0005)
    with pytest.raises(InputError, match="pdf or"):
        write_board(BOARD, tmp_path / "board.txt")


def test_a_worn_arm_is_said_and_the_printer_is_not_blamed(monkeypatch):
    monkeypatch.setattr(jiggled, "__defaults__", (np.deg2rad(0.2), 0.002))
    errors, noises = [], []
    for seed in range(4):
        found = solve_hand_eye(views(np.random.default_rng(seed)), BOARD, K, "fixed")
        errors.append(error_ahead_m(found.T_camera, T_BASE_CAMERA))
        noises.append((np.rad2deg(found.noise.turn_rad), 1e3 * found.noise.shift_m))
    assert np.median(errors) < 0.0015, errors
    np.testing.assert_allclose(np.median(noises, axis=0), [0.2, 2.0], rtol=0.25)
