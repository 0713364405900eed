"""HUMAN: a person at the page as a task planner."""

import numpy as np

from torc.episode.events import Decided, Event, Executed, Looked, Planned, Started
from torc.errors import InputError
from torc.records import Decision, Evidence, Exchange, PickPlan, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.web.session import Choice, Phase, Session

NAME = "human"
ASKED = "Which object should the robot pick next?"


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
        reply, reason = _told(choice)
        return Decision(
            choice.object_id,
            choice.note or reason,
            give_up=choice.give_up,
            is_target=choice.is_target and choice.object_id is not None,
            exchanges=(Exchange(ASKED, reply),),
            evidence=Evidence(notes={"expert": self._expert, "note": choice.note}),
        )


def _told(choice: Choice) -> tuple[str, str]:
    """Return the choice as a reply, and as a reason."""
    if choice.give_up:
        return "give up", "The expert gave up."
    if choice.object_id is None:
        return "none", "The expert let this pick pass: nothing can be grasped."
    if choice.is_target:
        return (
            f"{choice.object_id}, the target",
            f"The expert takes object {choice.object_id} for the target.",
        )
    return str(choice.object_id), f"The expert chose object {choice.object_id}."


class SessionListener:
    """Shows the progress of a trial on the pages."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def __call__(self, event: Event) -> None:
        """Publish one event of the trial."""
        publish = self._session.publish
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
