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
