"""For which robot a problem was made: generated ones say so where it was not the shipped one."""

from torc.scenes.problem import Problem

ROBOT_KEYS = NAME_KEY, SOURCE_KEY = "robot", "robot_source"
"""In a problem's origin: the robot's name, and the fingerprint of its files."""


def robot_wanted(problem: Problem) -> str:
    """Name of the robot of its own that a problem was made for; "" where it is the shipped one, or not known."""
    return str(problem.origin.get(NAME_KEY, "")) if SOURCE_KEY in problem.origin else ""


def robot_hint(problem: Problem, robot_source: str) -> str:
    """A sentence where a problem was made for another robot than the one with these files; "" where it was not."""
    if problem.origin.get(SOURCE_KEY, robot_source) == robot_source:
        return ""
    return (
        f"This problem was made for the robot '{robot_wanted(problem)}': give its file with --robot. For another robot "
        "things may be out of reach."
    )
