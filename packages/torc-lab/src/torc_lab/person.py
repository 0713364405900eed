"""Talk to the person beside the robot: questions, messages, and how often to ask."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from torc.cli.printing import printable
from torc.episode.events import Event, Planned
from torc.records import Trajectory
from torc_lab.devices import is_at_rest_pose
from torc_lab.lab_file import Lab
from torc_lab.protocols import LabError

Confirming = Literal["motion", "pick", "never"]
Ask = Callable[[str], bool]
"""Asks a yes-or-no question."""
AskText = Callable[[str], str]
"""Asks a question and returns a line of text."""


class Confirmation:
    """The `Confirm` of torc_lab.supervisor: asks before each motion, before the first of each pick, or never. It
    listens to the episode's events to know when a pick begins.
    """

    def __init__(self, how: Confirming, ask: Ask) -> None:
        self.how, self._ask = how, ask
        self._confirmed = False

    def __call__(self, what: str, trajectory: Trajectory) -> bool:
        """Return whether the motion may go."""
        if self.how == "never" or (self.how == "pick" and self._confirmed):
            return True
        turn = abs(trajectory.qpos[-1] - trajectory.qpos[0]).max()
        self._confirmed = self._ask(f"{what}, in which joints turn by up to {turn:.2f} rad. Go?")
        return self._confirmed

    def listen(self, event: Event) -> None:
        """Note that a new pick begins, which is when it has been planned."""
        if isinstance(event, Planned):
            self._confirmed = False


def ask_in_terminal(question: str) -> bool:
    """Ask until the answer is yes or no; the end of the input counts as no."""
    while True:
        try:
            answer = input(f"{question} [y/n] ").strip().lower()
        except (EOFError, OSError):  # its input, or its terminal, is gone
            return False
        if answer in ("y", "yes"):
            return True
        if answer in ("n", "no"):
            return False


def ask_text_in_terminal(question: str) -> str:
    """Ask for a line of text. Raises LabError at the end of the input, when nobody can answer."""
    try:
        return input(f"{question} ").strip()
    except (EOFError, OSError):
        raise LabError(f"Nobody answers: {question}") from None


def say_in_terminal(text: str) -> None:
    """Print text, with control characters escaped."""
    print(printable(text), flush=True)


@dataclass(frozen=True)
class Person:
    """How to reach the person who lays scenes out, stands by, and reports what sensors cannot see.

    Attributes:
        ask: asks a yes-or-no question.
        ask_text: asks for a line of text.
        say: shows a message.
    """

    ask: Ask = ask_in_terminal
    ask_text: AskText = ask_text_in_terminal
    say: Callable[[str], None] = say_in_terminal


def await_rest_pose(lab: Lab, qpos: Callable[[], np.ndarray], ask: Ask) -> None:
    """Wait until the arm is at its rest pose, where it does not hide the table; move nothing.

    Raises LabError if the person does not bring it there.
    """
    while not is_at_rest_pose(lab, now := qpos()):
        here, rest = (", ".join(f"{v:.2f}" for v in q) for q in (now, lab.robot.arm.rest_qpos))
        if not ask(
            f"The arm is at ({here}) rad, not at its rest pose ({rest}). Bring it there by hand. Ready?"
        ):
            raise LabError("The arm is not at its rest pose: it would hide the table from the camera.")
