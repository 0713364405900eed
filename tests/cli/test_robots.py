"""`torc robots`: the list, and the check of a robot file."""

import json

import numpy as np
import pytest
from PIL import Image

from tests.helpers.torc_command import run_torc
from torc.robots.loading import robot_file
from torc.robots.names import DATA, robot_names


def test_the_shipped_robots_are_listed(capsys):
    code, out, _ = run_torc("robots", "list", "--json", capsys=capsys)
    assert code == 0
    assert [row["name"] for row in json.loads(out)] == list(robot_names())
    _, out, _ = run_torc("robots", "list", capsys=capsys)
    assert "sda10f_2f85   7 joints, opens 85 mm   the default" in out


def test_a_robot_that_can_work_and_its_picture(tmp_path, capsys):
    picture = tmp_path / "r.png"
    code, out, _ = run_torc("robots", "check", "ur5e_2f85", "--picture", picture, "--json", capsys=capsys)
    assert code == 0
    assert {row["mark"] for row in json.loads(out)["checks"]} == {"ok"}
    assert np.ptp(np.array(Image.open(picture))) > 100


@pytest.fixture
def changed(tmp_path):
    """A shipped robot within an MJCF of one's own."""

    def write(around, inside=""):
        source = robot_file("ur5e_2f85").with_suffix(".xml")
        (tmp_path / "own.xml").write_text(
            f'<mujoco><asset><model name="r" file="{source}"/></asset><worldbody>{inside}<frame {around}>'
            '<attach model="r" prefix=""/></frame></worldbody></mujoco>'
        )
        text = (DATA / "ur5e_2f85" / "ur5e_2f85.yaml").read_text()
        old = next(line for line in text.splitlines() if line.startswith("mjcf:"))
        path = tmp_path / "own.yaml"
        path.write_text(text.replace(old, "mjcf: own.xml"))
        return path

    return write


def test_a_base_from_which_nothing_is_reached(changed, capsys):
    code, out, _ = run_torc("robots", "check", changed('pos="0 0 -3"'), capsys=capsys)
    assert code == 1
    assert "FAIL  reach" in out
    assert "Is the base where you think it is?" in out


def test_a_floor_of_its_own(changed, capsys):
    floor = '<geom name="ground" type="plane" size="0 0 .1"/>'
    code, out, _ = run_torc("robots", "check", changed('pos="0 0 0"', floor), capsys=capsys)
    assert code == 1
    assert "FAIL  surroundings  the MJCF holds a plane (ground)" in out
    assert "ok    gripper" in out


def test_files_that_cannot_be_read(tmp_path, capsys):
    (tmp_path / "r.yaml").write_text("format: torc-robot/1\n")
    for robot, words in ((tmp_path / "r.yaml", "not a valid robot file"), ("nobody", "ur5e_2f85")):
        code, _, err = run_torc("robots", "check", robot, capsys=capsys)
        assert code == 2
        assert words in err
