"""Names of robots. Light to import, for the command line."""

from pathlib import Path

DATA = Path(__file__).parent / "data"
"""Where the shipped robots are."""

DEFAULT_ROBOT = "sda10f_2f85"
"""The robot that torc40 and validation are made for: the right arm of a Yaskawa SDA10F with a Robotiq 2F-85."""


def robot_names() -> tuple[str, ...]:
    """The robots that are shipped."""
    return tuple(sorted(p.name for p in DATA.iterdir() if (p / f"{p.name}.yaml").is_file()))
