"""Load robots by name or file."""

from copy import deepcopy
from functools import cache
from pathlib import Path

from torc.errors import UnknownNameError
from torc.robots.description import RobotDescription
from torc.robots.names import DATA, DEFAULT_ROBOT, robot_names
from torc.robots.parsing import parse_robot
from torc.robots.schema import EXAMPLE


def load_robot(name_or_path: str | Path = DEFAULT_ROBOT) -> RobotDescription:
    """Load a robot description.

    Args:
        name_or_path: name of a shipped robot ("sda10f_2f85"), or path of a YAML file, which names its MJCF.

    Raises:
        UnknownNameError: it is neither.
        InputError: the files violate the format or contradict each other.
    """
    if (path := robot_file(name_or_path)) == Path(name_or_path):
        return parse_robot(path)
    return deepcopy(_shipped(path))  # its arrays are writable


def robot_file(name_or_path: str | Path) -> Path:
    """Return the YAML of a shipped robot, or the given path. Raises UnknownNameError if it is neither."""
    path = Path(name_or_path)
    if path.suffix in {".yaml", ".yml"} and path.is_file():
        return path
    if str(name_or_path) not in robot_names():
        own = f", or a YAML file of your own; compare {EXAMPLE}"
        raise UnknownNameError("robot (nor a YAML file)", str(name_or_path), list(robot_names()), own)
    return DATA / path.name / f"{path.name}.yaml"


def own_source(name_or_path: str) -> str:
    """Return the fingerprint of a robot's files; "" for shipped robots. Raises as `load_robot`."""
    robot = load_robot(name_or_path)
    return "" if name_or_path in robot_names() else robot.source


@cache
def _shipped(path: Path) -> RobotDescription:
    """Parse a shipped robot, once per process."""
    return parse_robot(path)
