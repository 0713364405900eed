"""A workspace whose camera sees nothing of the table is refused when it is loaded, by the reason."""

import numpy as np
import pytest
import yaml

from torc.errors import InputError
from torc.workspace.workspace_files import EXAMPLE, load_workspace


def written(tmp_path, obstacles=(), **camera):
    content = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    given = {k: v for k, v in content["camera"].items() if k in ("width", "height", "vertical_fov_deg")}
    if not {"T_world_camera", "position"} & set(camera):
        given |= {k: content["camera"][k] for k in ("position", "look_at")}
    content["camera"] = {**given, **camera}
    content["obstacles"] = list(obstacles)
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


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
        ({"vertical_fov_deg": 0.7}, "vertical_fov_deg"),
    ],
)
def test_what_sees_nothing_is_refused(tmp_path, camera, words):
    with pytest.raises(InputError, match=words):
        load_workspace(written(tmp_path, **camera))


def test_a_pose_with_the_axes_of_opengl_is_refused(tmp_path, workspace):
    good = written(tmp_path, T_world_camera=matrix(workspace, lambda T: T))
    np.testing.assert_allclose(load_workspace(good).camera.T_world_camera, workspace.camera.T_world_camera)
    opengl = matrix(workspace, lambda T: T @ np.diag([1.0, -1.0, -1.0, 1.0]))
    with pytest.raises(InputError, match="OpenCV axes"):
        load_workspace(written(tmp_path, T_world_camera=opengl))


def test_inverted_and_mirrored_poses_are_refused(tmp_path, workspace):
    with pytest.raises(InputError, match="below the table"):
        load_workspace(written(tmp_path, T_world_camera=matrix(workspace, np.linalg.inv)))
    mirror = matrix(workspace, lambda T: T @ np.diag([-1.0, 1.0, 1.0, 1.0]))
    with pytest.raises(InputError, match="without scale or mirror"):
        load_workspace(written(tmp_path, T_world_camera=mirror))


def test_places_where_nothing_can_be_are_refused(tmp_path):
    content = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    path = tmp_path / "own.yaml"
    for part, value, words in (
        ("region", content["region"] | {"origin": [5.0, 5.0, 1.05]}, "no part of it lies over the table"),
        ("bin", content["bin"] | {"drop_position": [0.7, 0.0, 1.2]}, "not above the bin"),
    ):
        path.write_text(yaml.safe_dump(content | {part: value}), encoding="utf-8")
        with pytest.raises(InputError, match=words):
            load_workspace(path)


def test_a_camera_in_an_obstacle_is_refused(tmp_path, workspace):
    x, y, z = (float(v) for v in workspace.camera.T_world_camera[:3, 3])
    post = {"name": "post", "center": [x, y, z], "size": [0.2, 0.2, 0.2]}
    with pytest.raises(InputError, match="inside 'post'"):
        load_workspace(written(tmp_path, obstacles=[post]))
    beside = {
        "name": "post",
        "center": [x - 0.11, y, z],
        "size": [0.2, 0.2, 0.2],
    }  # a mast that the camera is on
    load_workspace(written(tmp_path, obstacles=[beside]))
