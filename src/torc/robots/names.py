"""Names of robots. Light to import, for the command line."""

from pathlib import Path

DATA = Path(__file__).parent / "data"
"""Folder of the shipped robots."""

DEFAULT_ROBOT = "sda10f_2f85"
"""The robot of torc40 and validation: the right arm of a Yaskawa SDA10F with a Robotiq 2F-85."""


def robot_names() -> tuple[str, ...]:
    """Return the names of the shipped robots."""
    return tuple(sorted(p.name for p in DATA.iterdir() if (p / f"{p.name}.yaml").is_file()))
