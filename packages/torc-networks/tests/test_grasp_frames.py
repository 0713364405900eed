"""The frames of grasp networks, on poses worked out by hand, and there and back."""

import numpy as np
import pytest

from tools.grippers import write_slides
from torc.geometry.transforms import invert, make_pose
from torc.grasping.hand import hand_geometry
from torc.robots.loading import load_robot
from torc_networks.grasping.frames import (
    PANDA_TIP_M,
    along_axes,
    fingertips,
    gripper_config,
    measured_widths,
    tcp_of_contact_graspnet,
)

DOWN = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
"""Closing along world y, approaching straight down."""


@pytest.fixture(scope="module")
def gripper(robot):
    return robot.gripper


@pytest.fixture(scope="module")
def slides(tmp_path_factory):
    """A gripper whose fingertips travel straight, 140 mm wide."""
    return load_robot(str(write_slides(tmp_path_factory.mktemp("slides"), 0.14))).gripper


def test_contact_graspnet_by_hand():
    # The camera stands 1 m above the floor and looks along world x: its x is world -y, its y is world -z.
    R_world_camera = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    T_world_camera = make_pose(R_world_camera, [0.0, 0.0, 1.0])
    straight_ahead = make_pose(None, [0.1, 0.2, 0.5])
    # 90 degrees about the camera's x: the approach z becomes the camera's -y, which is up.
    upwards = make_pose(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), [0.0, 0.0, 0.5])
    Ts = tcp_of_contact_graspnet(np.stack([straight_ahead, upwards]), T_world_camera)
    np.testing.assert_allclose(Ts[0, :3, 3], [0.5 + 0.1034, -0.1, 0.8], atol=1e-12)
    np.testing.assert_allclose(Ts[0, :3, 2], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(Ts[0, :3, 0], [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(Ts[1, :3, 3], [0.5, 0.0, 1.0 + 0.1034], atol=1e-12)
    np.testing.assert_allclose(Ts[1, :3, 2], [0, 0, 1], atol=1e-12)


def test_contact_graspnet_there_and_back(rays):
    Ts, T_world_camera = rays(40), rays(1)[0]
    in_camera = along_axes(invert(T_world_camera) @ Ts, np.tile([0, 0, -PANDA_TIP_M], (40, 1)))
    np.testing.assert_allclose(tcp_of_contact_graspnet(in_camera, T_world_camera), Ts, atol=1e-12)


def test_along_axes_is_a_product_of_poses(rays, rng):
    Ts, offsets = rays(20), rng.normal(size=(20, 3))
    np.testing.assert_allclose(along_axes(Ts, offsets), [T @ make_pose(None, p) for T, p in zip(Ts, offsets)])


def test_graspgenx_by_hand(gripper):
    """base @ translation(fingertip): straight down from 1.3 m, with an offset along each of the base's axes."""
    T = along_axes(make_pose(DOWN, [0.6, -0.1, 1.3])[None], np.array([[0.01, 0.02, 0.15]]))[0]
    np.testing.assert_allclose(T[:3, 3], [0.6 + 0.02, -0.1 + 0.01, 1.3 - 0.15], atol=1e-12)
    np.testing.assert_array_equal(T[:3, :3], DOWN)


def test_fingertips_are_torcs_own_seen_from_the_flange(gripper, slides, rays):
    for hand in (gripper, slides):
        widths = np.linspace(0, hand.max_width_m, 9)
        tips = fingertips(hand, widths)
        for flange in rays(3):
            for width, tip in zip(widths, tips):
                tcp = flange @ hand.T_tool0_tcp(width)
                base = make_pose(tcp[:3, :3], flange[:3, 3])
                np.testing.assert_allclose(along_axes(base[None], tip[None])[0], tcp, atol=1e-12)


def test_measured_widths_against_every_point(gripper, rays, rng):
    hand = hand_geometry(gripper)
    Ts, points = rays(30), rng.uniform(-1, 1, (4000, 3)) * 0.08
    Ts[:, :3, 3] = rng.uniform(-0.03, 0.03, (30, 3))
    found = measured_widths(Ts, points, hand)
    for T, width in zip(Ts, found):
        by_hand = 0.0
        for p in points:
            x, y, z, _ = invert(T) @ np.append(p, 1.0)
            between = abs(x) <= hand.max_width_m / 2 and abs(y) < hand.finger_y and -hand.finger_z < z <= 0
            by_hand = max(by_hand, 2 * abs(x)) if between else by_hand
        assert width == pytest.approx(by_hand, abs=1e-12)
    assert (found > 0).any()


@pytest.mark.parametrize("off", [0.0, 0.01, -0.015])
def test_the_width_of_a_box_and_of_one_beside_the_middle(gripper, off):
    """40 mm wide, 10 mm off: the nearer pad meets it when the pads are 60 mm apart."""
    side = np.linspace(-0.02, 0.02, 11) + off
    points = np.array([[x, 0.0, z] for x in side for z in (-0.01, -0.03)])
    width = measured_widths(np.eye(4)[None], points, hand_geometry(gripper))[0]
    assert width == pytest.approx(2 * (0.02 + abs(off)))


def test_points_ahead_of_the_tips_beside_and_out_of_reach_have_no_width(gripper):
    hand = hand_geometry(gripper)
    for p in (
        [0.02, 0, 0.001],
        [0.02, hand.finger_y + 1e-4, -0.01],
        [0.043, 0, -0.01],
        [0.02, 0, -hand.finger_z - 1e-4],
    ):
        assert measured_widths(np.eye(4)[None], np.array([p]), hand).tolist() == [0.0]
    assert measured_widths(np.eye(4)[None], np.zeros((0, 3)), hand).tolist() == [0.0]


def test_the_description_has_the_gripper_in_it(gripper, slides):
    for hand in (gripper, slides):
        config = gripper_config(hand)
        width = hand.max_width_m
        tip = np.array(config["fingertip"])
        np.testing.assert_allclose(tip, hand.T_tool0_tcp(width)[:3, 3], atol=1e-9)
        low, high = np.array(config["bbox"])
        for b in (*hand.finger_boxes(width), *hand.palm_boxes(width)):
            assert (b.center - b.half_size + tip >= low - 1e-9).all()
            assert (b.center + b.half_size + tip <= high + 1e-9).all()
        assert high[2] == pytest.approx(tip[2], abs=2e-3)
        assert (config["type"], config["symmetric"], config["standoff"]) == ("parallel_2f", True, [0.0, 0.0])


@pytest.mark.parametrize(
    ("share", "extents", "offset"), [(1.0, "extents", "offset"), (0.5, "extents2", "offset2")]
)
def test_the_swept_volume_is_the_space_between_the_pads(gripper, slides, share, extents, offset):
    for hand in (gripper, slides):
        volume = gripper_config(hand)["sweep_volume"]
        half, center = np.array(volume[extents]) / 2, np.array(volume[offset])
        width = share * hand.max_width_m
        at_tip = center - hand.T_tool0_tcp(width)[:3, 3]
        left, right = hand.finger_boxes(width)
        assert half[0] == pytest.approx(width / 2)
        assert right.center[0] - right.half_size[0] == pytest.approx(at_tip[0] + half[0], abs=2e-3)
        assert left.center[0] + left.half_size[0] == pytest.approx(at_tip[0] - half[0], abs=2e-3)
        assert at_tip[2] + half[2] == pytest.approx(0, abs=1e-9)
        assert 2 * half[2] == pytest.approx(hand.pad_height_m)
        assert 2 * half[1] == pytest.approx(hand.pad_width_m)


def test_the_description_by_hand(gripper):
    """The numbers of the shipped 2F-85: fingertips 149 mm ahead of the flange when open, 160.6 mm when half open."""
    config = gripper_config(gripper)
    np.testing.assert_allclose(config["fingertip"], [0, 0, 0.149], atol=5e-4)
    np.testing.assert_allclose(config["sweep_volume"]["extents"], [0.085, 0.022, 0.0375], atol=1e-6)
    np.testing.assert_allclose(config["sweep_volume"]["offset"], [0, 0, 0.149 - 0.01875], atol=5e-4)
    np.testing.assert_allclose(config["sweep_volume"]["offset2"], [0, 0, 0.1606 - 0.01875], atol=5e-4)
