"""For which robot a problem was made: generated ones say so where it was not the shipped one."""

from torc.problems.problem import Problem

ROBOT_KEYS = NAME_KEY, SOURCE_KEY = "robot", "robot_source"
"""In a problem's origin: the robot's name, and the fingerprint of its files."""


def robot_wanted(problem: Problem) -> str:
    """Name of the robot of its own that a problem was made for; "" where it is the shipped one, or not known."""
    return str(problem.origin.get(NAME_KEY, "")) if SOURCE_KEY in problem.origin else ""


def robot_hint(problem: Problem, name: str, source: str) -> str:
    """What to say of a problem that was made for another robot than this one; "" where it was not.

    Args:
        problem: the problem.
        name, source: of the robot that is to play it; the latter is the fingerprint of its files.
    """
    if problem.origin.get(SOURCE_KEY, source) == source:
        return ""
    wanted = robot_wanted(problem)
    if wanted == name:
        return f"Made for the robot '{wanted}' before its files were changed: things may be out of reach."
    return f"Made for the robot '{wanted}': give its file with --robot. For another one things may be out of reach."
