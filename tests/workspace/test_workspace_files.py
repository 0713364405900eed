"""Workspace files: the shipped one, and what is wrong with others."""

import numpy as np
import pytest
import yaml

from torc.errors import InputError
from torc.workspace.workspace_files import EXAMPLE, load_workspace, own_workspace_source


def written(tmp_path, change):
    content = yaml.safe_load(EXAMPLE.read_text())
    change(content)
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_the_shipped_one_is_the_papers():
    shipped = load_workspace()
    assert (shipped.name, own_workspace_source("paper")) == ("paper", "")
    assert shipped.support_z_m == 1.05
    assert np.array_equal(shipped.camera.T_world_camera[:3, 3], (0.10, 0.0, 1.38))
    assert np.array_equal(shipped.grid.origin, (0.42, -0.62, 1.05))
    assert shipped.bin.inner_size == (0.36, 0.34, 0.34)


def test_a_camera_pose_can_be_a_matrix(tmp_path):
    T = load_workspace().camera.T_world_camera

    def by_matrix(content):
        del content["camera"]["position"], content["camera"]["look_at"]
        content["camera"]["T_world_camera"] = T.tolist()

    assert np.allclose(load_workspace(written(tmp_path, by_matrix)).camera.T_world_camera, T)


def test_its_fingerprint_is_what_is_in_it(tmp_path):
    path = written(tmp_path, lambda content: None)
    first = own_workspace_source(str(path))
    path.write_text("# another comment\n" + path.read_text())
    assert own_workspace_source(str(path)) == first
    wider = written(tmp_path, lambda content: content["table"].update(size=[0.68, 1.40, 0.10]))
    assert own_workspace_source(str(wider)) != first


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda c: c.update(format="torc-workspace/2"), "format"),
        (lambda c: c.pop("bin"), "bin"),
        (lambda c: c.update(tabel={}), "tabel"),
        (lambda c: c["region"].update(origin=[0.4, -0.6, 0.9]), "the table's upper side, at z = 1.05"),
        (lambda c: c["region"].update(shape=[1000, 1000, 1000]), "voxels"),
        (lambda c: c["camera"].pop("look_at"), "either position and look_at, or T_world_camera"),
        (lambda c: c["camera"].update(vertical_fov_deg=200.0), "vertical_fov_deg"),
        (lambda c: c["table"].update(size=[0.5, -1.0, 0.1]), "table.size"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, change, told):
    with pytest.raises(InputError, match="not a valid workspace") as refused:
        load_workspace(written(tmp_path, change))
    assert told in str(refused.value)


def seen_from(tmp_path, obstacles=(), **camera):
    content = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    given = {k: v for k, v in content["camera"].items() if k in ("width", "height", "vertical_fov_deg")}
    if not {"T_world_camera", "position"} & set(camera):
        given |= {k: content["camera"][k] for k in ("position", "look_at")}
    content["camera"] = {**given, **camera}
    content["obstacles"] = list(obstacles)
    return written(tmp_path, lambda now: now.update(content))


def matrix(workspace, turn):
    return [[float(v) for v in row] for row in turn(workspace.camera.T_world_camera)]


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        ({"position": [0.1, 0, 1.4], "look_at": [0.1, 0, 1.4]}, "look_at is the camera's position"),
        ({"position": [0.1, 0, 1.4], "look_at": [-1.0, 0, 1.4]}, "sees 0% of the watched part"),
        ({"position": [0.1, 0, 1.4], "look_at": [0.2, 0, 3.0]}, "sees 0% of the watched part"),
        ({"position": [0.65, -0.1, 1.04], "look_at": [0.65, 0.3, 1.2]}, "inside 'table'"),
        ({"position": [0.24, -0.88, 0.9], "look_at": [0.6, 0, 1.1]}, "inside 'bin'"),
        ({"position": [0.7, 0, 2.4], "look_at": [0.7, 0, 1.05]}, "straight above or below"),
        ({"position": [0.1, 0, 0.5], "look_at": [0.6, 0, 1.1]}, "below the table's upper side"),
        ({"position": [100.0, 0, 138.0], "look_at": [0.6, 0, 1.1]}, "Are these metres"),
        ({"vertical_fov_deg": 1.0}, "Is it in radians\\? Then write 57.3"),
        ({"vertical_fov_deg": 0.01}, "vertical_fov_deg"),
    ],
)
def test_what_sees_nothing_is_refused(tmp_path, camera, words):
    with pytest.raises(InputError, match=words):
        load_workspace(seen_from(tmp_path, **camera))


def test_a_pose_with_the_axes_of_opengl_is_refused(tmp_path, workspace):
    good = seen_from(tmp_path, T_world_camera=matrix(workspace, lambda T: T))
    np.testing.assert_allclose(load_workspace(good).camera.T_world_camera, workspace.camera.T_world_camera)
    opengl = matrix(workspace, lambda T: T @ np.diag([1.0, -1.0, -1.0, 1.0]))
    with pytest.raises(InputError, match="OpenCV axes"):
        load_workspace(seen_from(tmp_path, T_world_camera=opengl))


def test_inverted_and_mirrored_poses_are_refused(tmp_path, workspace):
    with pytest.raises(InputError, match="below the table"):
        load_workspace(seen_from(tmp_path, T_world_camera=matrix(workspace, np.linalg.inv)))
    mirror = matrix(workspace, lambda T: T @ np.diag([-1.0, 1.0, 1.0, 1.0]))
    with pytest.raises(InputError, match="without scale or mirror"):
        load_workspace(seen_from(tmp_path, T_world_camera=mirror))


def test_places_where_nothing_can_be_are_refused(tmp_path):
    content = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    for part, value, words in (
        ("region", content["region"] | {"origin": [5.0, 5.0, 1.05]}, "no part of it lies over the table"),
        ("bin", content["bin"] | {"drop_position": [0.7, 0.0, 1.2]}, "not above the bin"),
        ("room", {"center": [5, 5], "size": [0.3, 0.3], "height": 0.2}, "room: no part"),
    ):
        with pytest.raises(InputError, match=words):
            load_workspace(written(tmp_path, lambda now, part=part, value=value: now.update({part: value})))


def test_a_camera_in_an_obstacle_is_refused(tmp_path, workspace):
    x, y, z = (float(v) for v in workspace.camera.T_world_camera[:3, 3])
    post = {"name": "post", "center": [x, y, z], "size": [0.2, 0.2, 0.2]}
    with pytest.raises(InputError, match="inside 'post'"):
        load_workspace(seen_from(tmp_path, obstacles=[post]))
    beside = post | {"center": [x - 0.11, y, z]}  # a mast that the camera is on
    load_workspace(seen_from(tmp_path, obstacles=[beside]))
