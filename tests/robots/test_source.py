"""A robot is what is in its files, not where they lie."""

import os
import shutil

import numpy as np
import pytest
from PIL import Image

from torc.robots.loading import load_robot, own_source
from torc.robots.names import DEFAULT_ROBOT

ASSETS = """
  <asset>
    <mesh name="cover" file="cover.obj"/>
    <texture name="paint" type="2d" file="paint.png"/><material name="paint" texture="paint"/>
  </asset>
  <worldbody><body name="cover"><geom type="mesh" mesh="cover" material="paint" contype="0" conaffinity="0"/></body>
  <include file="more.xml"/>
"""
COVER = "v 0 0 1\nv .1 0 1\nv 0 .1 1\nv 0 0 {}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
INCLUDED = (
    '<mujoco><body name="more" pos="0 0 {}"><geom size=".01" contype="0" conaffinity="0"/></body></mujoco>'
)


@pytest.fixture
def directory(write_other_robot, tmp_path):
    """A robot with a mesh, a texture and an included file."""
    path = write_other_robot("<worldbody>", ASSETS, mjcf=True)
    path.rename(tmp_path / "robot.yaml")
    _paint(tmp_path, 100)
    (tmp_path / "cover.obj").write_text(COVER.format(1.1))
    (tmp_path / "more.xml").write_text(INCLUDED.format(0.1))
    return tmp_path


def _paint(directory, shade):
    Image.fromarray(np.full((4, 4, 3), shade, np.uint8)).save(directory / "paint.png")


def _source(directory):
    return own_source(str(directory / "robot.yaml"))


def test_where_the_files_lie_does_not_count(directory, tmp_path_factory, monkeypatch):
    there = tmp_path_factory.mktemp("some other place") / "of_another_length"
    shutil.copytree(directory, there)
    assert _source(there) == _source(directory)
    monkeypatch.chdir(there)
    assert own_source("robot.yaml") == _source(directory)


@pytest.mark.parametrize("changed", ["robot.yaml", "other.xml", "more.xml", "cover.obj", "paint.png"])
def test_what_is_in_each_of_them_counts(directory, changed):
    before = _source(directory)
    assert len(before) == 64
    path = directory / changed
    match path.suffix:
        case ".yaml":
            path.write_text(path.read_text().replace("speed_deg_s: 90", "speed_deg_s: 80", 1))
        case ".obj":
            path.write_text(COVER.format(1.2))
        case ".png":
            _paint(directory, 101)
        case _:
            path.write_text(path.read_text().replace("0.1", "0.11", 1))
    os.utime(
        path, (0, path.stat().st_mtime + 5)
    )  # by whole seconds MuJoCo tells whether a mesh or picture is another
    assert _source(directory) != before


def test_shipped_robots_are_known_by_name_alone():
    assert own_source(DEFAULT_ROBOT) == ""
    assert len(load_robot().source) == 64
