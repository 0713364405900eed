"""What the camera sees agrees with where things are, with every backend."""

import numpy as np
import pytest
from sim_scenes import row, standing, world_of

from torc.errors import InputError
from torc.geometry.transforms import project
from torc.records import BACKGROUND, ROBOT
from torc.robots.loading import load_robot
from torc.sim.gl import gl_backend
from torc.sim.rendering import CameraRenderer
from torc.sim.robot import SimulatedCamera
from torc.workspace.workspace_files import load_workspace

MOUNT = load_workspace().camera
BACKENDS = ["rays"] if gl_backend() == "rays" else [gl_backend(), "rays"]


@pytest.fixture(scope="module")
def world():
    return world_of(*row("soup_can_red", "mug_red", "cracker_box_red", "bowl_blue"), robot=load_robot())


@pytest.fixture(scope="module")
def views(world):
    views = {}
    for backend in BACKENDS:
        with CameraRenderer(world, MOUNT, backend) as renderer:
            views[backend] = renderer.render()
    return views


@pytest.mark.parametrize("backend", BACKENDS)
def test_labels_are_valid_and_everything_is_in_sight(views, backend):
    labels = views[backend].label_image
    assert labels.dtype == np.int16
    assert set(np.unique(labels)) <= {BACKGROUND, ROBOT, 0, 1, 2, 3}
    assert {0, 1, 2, 3} <= set(np.unique(labels))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_small_object_appears_where_it_projects_to(backend):
    world = world_of(standing("ball", "apple_red", 0.62, -0.2))
    with CameraRenderer(world, MOUNT, backend) as renderer:
        view = renderer.render()
    rows, cols = np.nonzero(view.label_image == 0)
    u, v, depth = project(world.positions[:1], MOUNT.K, MOUNT.T_world_camera)
    assert cols.mean() == pytest.approx(u[0], abs=3.0)
    assert rows.mean() == pytest.approx(v[0], abs=3.0)
    near = view.depth_m[rows, cols].min()
    assert depth[0] - world.models[0].size_m[0] / 2 == pytest.approx(near, abs=0.01)


@pytest.mark.skipif(len(BACKENDS) == 1, reason="no GL on this machine: nothing to compare with")
def test_rays_and_gl_agree(views):
    gl, rays = (views[b] for b in BACKENDS)
    assert np.mean(gl.label_image == rays.label_image) > 0.99
    assert np.median(np.abs(gl.depth_m - rays.depth_m)) < 1e-3
    assert np.mean(np.abs(gl.depth_m - rays.depth_m) > 5e-3) < 0.01


def test_pictures_repeat_exactly(world):
    with CameraRenderer(world, MOUNT) as a, CameraRenderer(world, MOUNT) as b:
        first, second, again = a.render(), b.render(), a.render()
    for other in (second, again):
        assert np.array_equal(first.rgb, other.rgb)
        assert np.array_equal(first.depth_m, other.depth_m)
        assert np.array_equal(first.label_image, other.label_image)


def test_pictures_do_not_depend_on_what_was_drawn_before(world, views):
    other = world_of(*row("apple_green", "mug_white", "cereal_box_yellow"), robot=load_robot())
    for _ in range(2):
        with CameraRenderer(other, MOUNT) as renderer:
            renderer.render()
        with CameraRenderer(world, MOUNT) as renderer:
            found = renderer.render()
        assert np.array_equal(found.rgb, views[gl_backend()].rgb)
        assert np.array_equal(found.depth_m, views[gl_backend()].depth_m)
        assert np.array_equal(found.label_image, views[gl_backend()].label_image)


def test_the_camera_delivers_an_observation_and_beside_it_the_true_labels(world, views):
    with SimulatedCamera(world) as camera:
        capture = camera.capture()
    observation = capture.observation
    assert observation.rgb.shape == (MOUNT.height, MOUNT.width, 3)
    assert np.array_equal(capture.label_image, views[gl_backend()].label_image)
    assert np.array_equal(observation.qpos, load_robot().arm.rest_qpos)
    assert np.array_equal(observation.K, MOUNT.K)


def test_unknown_backends_are_named(world):
    with pytest.raises(InputError, match="egl, osmesa"):
        CameraRenderer(world, MOUNT, "vulkan")
