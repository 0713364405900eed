"""The simulated stereo camera: its pictures fit the scene, and matching them gives the scene's depth with holes."""

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.stereo import SgbmConfig, sgbm_depth
from torc.problems.problem import load_problem
from torc.sim.robot import SimulatedCamera
from torc.sim.simulated_world import build_world
from torc.sim.stereo_camera import StereoRig, stereo_pair
from torc.workspace.workspace_files import load_workspace


@pytest.fixture(scope="module")
def snapshot():
    world = build_world(load_problem("structured-04"), None, load_workspace())
    with SimulatedCamera(world, rig=StereoRig()) as camera:
        yield camera.capture(), camera.capture()


def _error(capture, rig_depth):
    labelled = capture.label_image >= 0
    both = (rig_depth > 0) & labelled
    return np.abs(rig_depth - capture.observation.depth_m)[both], np.mean(rig_depth[labelled] > 0)


def test_matching_gives_the_depth_of_objects_within_millimetres_with_holes_and_flying_edges(snapshot):
    observation = snapshot[0].observation
    depth = sgbm_depth(observation.pair, float(observation.K[0, 0]), SgbmConfig())
    error, share = _error(snapshot[0], depth)
    assert np.median(error) < 0.003
    assert 0.85 < share < 1.0
    assert 0.0 < np.mean(error > 0.02) < 0.1


def test_the_same_moment_gives_the_same_pair(snapshot):
    first, second = (capture.observation.pair for capture in snapshot)
    np.testing.assert_array_equal(first.left, second.left)
    np.testing.assert_array_equal(first.right, second.right)
    assert not np.array_equal(first.left, first.right)


def test_dots_do_not_reach_into_the_shadow_of_the_projector():
    """A wall behind a post: beside the post's picture is a strip that the left camera sees and no dot reaches."""
    rig = StereoRig(baseline_m=0.12, light=0.0, shot_noise=0.0, read_noise=0.0)
    K = np.array([[300.0, 0, 99.5], [0, 300.0, 59.5], [0, 0, 1]])

    def post(camera_x):
        """Depth of a post of 8 cm at .5 m before a wall at 1 m, from a camera at camera_x."""
        depth = np.full((120, 200), 1.0, np.float32)
        left, right = (300 * (x - camera_x) / 0.5 + 99.5 for x in (-0.04, 0.04))
        depth[:, max(int(np.ceil(left)), 0) : int(right) + 1] = 0.5
        return depth

    depths = post(-0.06), post(0.06)
    white = np.full((120, 200, 3), 255, np.uint8)
    pair = stereo_pair(rig, (white, white), depths, K, np.random.default_rng(0))
    # The post's shadow on the wall reaches from -.08 to .08 m; left of -.02 m the left camera sees the wall.
    columns = slice(int(300 * (-0.075 + 0.06) + 99.5), int(300 * (-0.03 + 0.06) + 99.5))
    dark, lit = pair.left[:, columns], pair.left[:, :60]
    assert dark.max(initial=0) == 0
    assert lit.mean() > 5


def test_dots_are_as_bright_as_the_cosine_of_the_angle_at_which_they_arrive():
    rig = StereoRig(light=0.0, shot_noise=0.0, read_noise=0.0)
    K = np.array([[600.0, 0, 99.5], [0, 600.0, 59.5], [0, 0, 1]])
    white = np.full((120, 200, 3), 255, np.uint8)
    x = ((np.arange(200) - 99.5) / 600).astype(np.float32)

    def brightness(degrees):
        """Of a plane 1 m before the projector, turned from it about the vertical."""
        tangent = np.float32(np.tan(np.radians(degrees)))
        left, right = (
            np.tile((1 - tangent * side * np.float32(rig.baseline_m)) / (1 + tangent * x), (120, 1))
            for side in (-0.5, 0.5)
        )
        pair = stereo_pair(rig, (white, white), (left, right), K, np.random.default_rng(0))
        return pair.left[10:-10, 60:-60].mean()

    for degrees in (30, 50):
        # Turned either way, since one side of the picture is nearer.
        both = (brightness(degrees) + brightness(-degrees)) / 2
        assert both / brightness(0) == pytest.approx(np.cos(np.radians(degrees)), abs=0.06)


@pytest.mark.parametrize("wrong", [{"baseline_m": 0.0}, {"dots": -1.0}])
def test_rigs_without_sense_are_refused(wrong):
    with pytest.raises(InputError):
        StereoRig(**wrong)
