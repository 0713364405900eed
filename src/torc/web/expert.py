"""HUMAN: a person at the page as a task planner."""

import numpy as np

from torc.episode.events import Decided, Event, Executed, Looked, Planned, Started
from torc.records import Decision, Exchange, PickPlan, PlanningContext
from torc.web.session import Choice, Phase, Session

NAME = "human"
ASKED = "Which object should the robot pick next?"


class HumanPlanner:
    """Asks the person at the page, and waits. The page offers only what a planner may name, so it asks once."""

    name = NAME

    def __init__(self, session: Session, expert: str = "") -> None:
        """expert: the person's name, kept with each decision."""
        self._session, self._expert = session, expert

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """The person's choice. Draws nothing from rng."""
        choice = self._session.ask_object(len(context.history), context.report.graspable_ids)
        return Decision(
            choice.object_id,
            choice.note or _reason(choice),
            give_up=choice.give_up,
            exchanges=(Exchange(ASKED, _reply(choice)),),
            evidence={"expert": self._expert, "note": choice.note},
        )


def _reply(choice: Choice) -> str:
    if choice.give_up:
        return "give up"
    return "none" if choice.object_id is None else str(choice.object_id)


def _reason(choice: Choice) -> str:
    if choice.give_up:
        return "The expert gave up."
    if choice.object_id is None:
        return "The expert let this pick pass: nothing can be grasped."
    return f"The expert chose object {choice.object_id}."


class SessionListener:
    """Tells the pages what a trial is doing."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def __call__(self, event: Event) -> None:
        """One event of the trial."""
        publish = self._session.publish
        match event:
            case Started():
                publish(phase=Phase.LOOKING, message="Looking")
            case Looked():
                publish(phase=Phase.LOOKING, pick=event.pick, message="")
            case Decided():
                publish(phase=Phase.PLANNING)
            case Planned():
                if isinstance(event.plan, PickPlan):
                    publish(phase=Phase.EXECUTING, message=f"The robot picks object {event.plan.object_id}")
            case Executed():
                publish(
                    phase=Phase.LOOKING,
                    message=f"Pick {event.pick + 1}: {event.outcome.as_felt.result.value}",
                )
            case _:
                pass
