"""HUMAN, and its link to the pages: a trial waits for a person, and there may be any number of pages.

One thread plays trials and asks; the server's threads read the state and answer. The state is one small record that is
replaced as a whole: a reader at any moment, however late, can show where things stand.
"""

import threading
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as checked_dataclass

from torc.episode.events import Decided, Event, Executed, Looked, Planned, Started
from torc.errors import InputError
from torc.records import Decision, Evidence, Exchange, PickPlan, PlanningContext
from torc.registry.kinds import TaskPlannerTraits

NAME = "human"
_ASKED = "Which object should the robot pick next?"


class Phase(StrEnum):
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
    """The state of a session; `version` rises with every change.

    `trial` is the key of the trial that is or was last played, `allowed` are the ids that may be chosen while phase is
    CHOOSING, `chosen` the one of this pick, `message` a line for people, `waiting` keys of trials that may be started.
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
    """An answer of the expert to the question of that trial and pick; `note` says why, in the expert's words.

    `object_id` is None to let the pick pass, or with `give_up`; `is_target`: the expert takes it for the target.
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
    """Holds the present `state`, and passes questions and answers between the trial and the pages."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self.state = SessionState()
        self._answer: Any = None

    def publish(self, **changes: Any) -> None:
        """Replace parts of the state and notify the pages."""
        with self._changed:
            self._set(**changes)

    def show(self, event: Event) -> None:
        """Show an event of the trial on the pages."""
        publish = self.publish
        match event:
            case Started():
                publish(phase=Phase.LOOKING, message="Looking")
            case Looked():
                publish(phase=Phase.LOOKING, pick=event.pick, message="")
            case Decided():
                publish(phase=Phase.PLANNING)
            case Planned(plan=PickPlan() as plan):
                publish(phase=Phase.EXECUTING, message=f"The robot picks object {plan.object_id}")
            case Executed():
                felt = event.outcome.as_felt.result.value
                publish(phase=Phase.LOOKING, message=f"Pick {event.pick + 1}: {felt}")

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
            if self.state.phase is not Phase.READY:
                raise RefusedError("A trial is being played; another one can be started when it is over.")
            if key not in self.state.waiting:
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
        state, chosen = self.state, choice.object_id
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
        self.state = replace(self.state, version=self.state.version + 1, **changes)
        self._changed.notify_all()


class HumanPlanner(TaskPlannerTraits):
    """Asks the person at the page, and waits. The page offers only what a planner may name, so it asks once."""

    name = NAME

    def __init__(self, session: Session | None = None, expert: str = "") -> None:
        """Take the session, and the person's name, kept with each decision. Raises InputError without a session."""
        if session is None:
            raise InputError("A person chooses at a page in the browser: `torc human PROBLEM` opens it.")
        self._session, self._expert = session, expert

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the person's choice. Draws nothing from rng."""
        choice = self._session.ask_object(len(context.history), context.report.graspable_ids)
        chosen, is_target = choice.object_id, choice.is_target and choice.object_id is not None
        reply, reason = str(chosen), f"The expert chose object {chosen}."
        if choice.give_up:
            reply, reason = "give up", "The expert gave up."
        elif chosen is None:
            reply, reason = "none", "The expert let this pick pass: nothing can be grasped."
        elif is_target:
            reply, reason = f"{chosen}, the target", f"The expert takes object {chosen} for the target."
        return Decision(
            chosen,
            choice.note or reason,
            give_up=choice.give_up,
            is_target=is_target,
            exchanges=(Exchange(_ASKED, reply),),
            evidence=Evidence(notes={"expert": self._expert, "note": choice.note}),
        )
