"""The person beside the robot: what he is asked, and how often."""

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
"""Asks a question that is answered with yes or no."""
AskText = Callable[[str], str]
"""Asks a question that is answered with a line of text."""


class Confirmation:
    """The `Confirm` of torc_lab.supervisor: asks before each motion, before the first of each pick, or never. It
    listens to the episode, which tells when a pick begins.
    """

    def __init__(self, how: Confirming, ask: Ask) -> None:
        self.how, self._ask = how, ask
        self._confirmed = False

    def __call__(self, what: str, trajectory: Trajectory) -> bool:
        """Whether to go."""
        if self.how == "never" or (self.how == "pick" and self._confirmed):
            return True
        turn = abs(trajectory.qpos[-1] - trajectory.qpos[0]).max()
        self._confirmed = self._ask(f"{what}, in which joints turn by up to {turn:.2f} rad. Go?")
        return self._confirmed

    def listen(self, event: Event) -> None:
        """Another pick begins with its plan."""
        if isinstance(event, Planned):
            self._confirmed = False


def ask_in_terminal(question: str) -> bool:
    """Asks until the answer is yes or no; no answer, at the end of the input, is a no."""
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
    """Asks for a line. Raises LabError at the end of the input: there is nobody to answer."""
    try:
        return input(f"{question} ").strip()
    except (EOFError, OSError):
        raise LabError(f"Nobody answers: {question}") from None


def say_in_terminal(text: str) -> None:
    """Prints text; names of strangers' files in it cannot move the cursor."""
    print(printable(text), flush=True)


@dataclass(frozen=True)
class Person:
    """Who lays scenes out, stands by, and tells what sensors cannot.

    Attributes:
        ask: yes or no.
        ask_text: a line of text.
        say: tells something.
    """

    ask: Ask = ask_in_terminal
    ask_text: AskText = ask_text_in_terminal
    say: Callable[[str], None] = say_in_terminal


def await_rest_pose(lab: Lab, qpos: Callable[[], np.ndarray], ask: Ask) -> None:
    """Waits until the arm is where it does not hide the table; moves nothing.

    Raises LabError if nobody brings it there.
    """
    while not is_at_rest_pose(lab, now := qpos()):
        here, rest = (", ".join(f"{v:.2f}" for v in q) for q in (now, lab.robot.arm.rest_qpos))
        if not ask(
            f"The arm is at ({here}) rad, not at its rest pose ({rest}). Bring it there by hand. Ready?"
        ):
            raise LabError("The arm is not at its rest pose: it would hide the table from the camera.")
