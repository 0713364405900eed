"""The link between the trial, which waits for a person, and the pages, of which there may be any number.

One thread plays trials and asks; the server's threads read the state and answer. The state is one small record that is
replaced as a whole: a reader at any moment, however late, can show where things stand.
"""

import threading
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated, Any

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as checked_dataclass

from torc.errors import InputError


class Phase(StrEnum):
    """The phases of a session."""

    READY = "ready"
    """Waiting for a page to start a trial."""
    PREPARING = "preparing"
    LOOKING = "looking"
    CHOOSING = "choosing"
    """Waiting for the expert's choice."""
    PLANNING = "planning"
    EXECUTING = "executing"
    DONE = "done"
    """Nothing is left in the queue."""


@dataclass(frozen=True)
class SessionState:
    """The state of a session.

    Attributes:
        version: rises with every change.
        phase: the present phase.
        trial: key of the trial being played, or of the one that was played last.
        pick: number of the pick.
        allowed: ids that may be chosen while phase is CHOOSING.
        chosen: id that was chosen in this pick.
        message: a line for people.
        waiting: keys of the trials that may be started.
    """

    version: int = 0
    phase: Phase = Phase.PREPARING
    trial: str | None = None
    pick: int = 0
    allowed: tuple[int, ...] = ()
    chosen: int | None = None
    message: str = ""
    waiting: tuple[str, ...] = ()


@checked_dataclass(frozen=True, config=ConfigDict(extra="forbid", strict=True))
class Choice:
    """An answer of the expert.

    Attributes:
        trial, pick: which question it answers.
        object_id: what to pick; None to let the pick pass, or with give_up.
        give_up: end the trial.
        is_target: the expert takes the object for the target.
        note: why, in the expert's words; may be empty.
    """

    trial: str
    pick: int
    object_id: int | None = None
    give_up: bool = False
    is_target: bool = False
    note: Annotated[str, Field(max_length=500)] = ""


class RefusedError(InputError):
    """An answer that comes too late, twice, or to no question; the text says which."""


class Session:
    """Holds the state, and passes questions and answers between the trial and the pages."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._state = SessionState()
        self._answer: Any = None

    @property
    def state(self) -> SessionState:
        """The present state."""
        return self._state

    def publish(self, **changes: Any) -> None:
        """Replace parts of the state and notify the pages."""
        with self._changed:
            self._set(**changes)

    def ask_object(self, pick: int, allowed: tuple[int, ...]) -> Choice:
        """Wait for the expert's choice. Called by the thread that plays."""
        return self._ask(phase=Phase.CHOOSING, pick=pick, allowed=allowed, chosen=None)

    def ask_start(self, waiting: tuple[str, ...], message: str) -> str:
        """Wait until a page starts one of these trials; return its key."""
        return self._ask(phase=Phase.READY, waiting=waiting, message=message)

    def choose(self, choice: Choice) -> None:
        """Answer `ask_object`. Raises RefusedError: another pick or trial, answered before, or object not allowed."""
        with self._changed:
            self._check(choice)
            what = "The expert gave up" if choice.give_up else "Planning the motions"
            self._set(phase=Phase.PLANNING, chosen=choice.object_id, allowed=(), message=what)
            self._answer = choice

    def start(self, key: str) -> None:
        """Answer `ask_start`. Raises RefusedError: a trial is being played, or this one does not wait."""
        with self._changed:
            if self._state.phase is not Phase.READY:
                raise RefusedError("A trial is being played; another one can be started when it is over.")
            if key not in self._state.waiting:
                raise RefusedError("This trial is not in the queue any more.")
            self._set(phase=Phase.PREPARING, trial=key, pick=0, chosen=None, waiting=())
            self._answer = key

    def _ask(self, **question: Any) -> Any:
        with self._changed:
            self._answer = None
            self._set(**question)
            while self._answer is None:
                # With a time limit Ctrl-C gets through on every system.
                self._changed.wait(1.0)
            return self._answer

    def _check(self, choice: Choice) -> None:
        state, chosen = self._state, choice.object_id
        if choice.trial != state.trial:
            raise RefusedError("That choice is for another trial. Reload the page to see the present one.")
        if choice.pick != state.pick:
            raise RefusedError(f"That choice is for pick {choice.pick + 1}; it is pick {state.pick + 1} now.")
        if state.phase is not Phase.CHOOSING:
            made = "" if state.chosen is None else f": object {state.chosen}"
            raise RefusedError(f"Pick {state.pick + 1} has been decided already{made}.")
        if choice.give_up or chosen in state.allowed or (chosen is None and not state.allowed):
            return
        graspable = ", ".join(map(str, state.allowed)) or "none"
        what = "Name an object" if chosen is None else f"Object {chosen} cannot be grasped now"
        raise RefusedError(f"{what}; these can: {graspable}.")

    def _set(self, **changes: Any) -> None:
        self._state = replace(self._state, version=self._state.version + 1, **changes)
        self._changed.notify_all()
