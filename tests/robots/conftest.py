"""The shipped robots, one after the other; and one as a user would write it: six joints, no spherical shoulder, and a
gripper whose fingers slide."""

from collections.abc import Callable
from pathlib import Path

import pytest

from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.robots.names import robot_names

WriteRobot = Callable[..., Path]


@pytest.fixture(scope="session", params=robot_names())
def robot(request: pytest.FixtureRequest) -> RobotDescription:
    """Each shipped robot."""
    return load_robot(request.param)


@pytest.fixture
def write_other_robot(tmp_path: Path) -> WriteRobot:
    """Writes the robot's files, with `old` replaced by `new` in one of them; returns the YAML's path."""

    def write(old: str = "", new: str = "", mjcf: bool = False) -> Path:
        for name, changed in (("other.yaml", not mjcf), ("other.xml", mjcf)):
            text = (Path(__file__).parent / name).read_text()
            if changed and old not in text:
                raise ValueError(f"'{old}' is not in {name}.")
            (tmp_path / name).write_text(text.replace(old, new, 1) if changed else text)
        return tmp_path / "other.yaml"

    return write
