"""What planners that ask no model, and simulated models, choose at a look: decided once, kept in the data."""

from collections.abc import Callable, Mapping

import numpy as np

from torc import PlanningContext, make_planner
from torc.task_planning.protocol import TaskPlanner
from torc.vlm.answers import PLAN_SCHEMA
from torc.vlm.protocol import Question
from torc.vlm.question_facts import grasp_facts
from torc.vlm.simulated.client import SimulatedVlm
from torc.vlm.simulated.profiles import find_profile
from torc.vlm.simulated.situation import Situation
from torc_next_object.replies import read_number

PLANNERS = ("dg-select", "learned", "belief")
ACCURACIES = ("0.5", "0.7", "0.8", "0.9", "1.0")
_REPEATS = 2**31


class Baselines:
    """Makes the planners once, and asks them at look after look. They are told what models are: what is graspable."""

    def __init__(self) -> None:
        self._planners: Mapping[str, TaskPlanner] = {name: make_planner(name) for name in PLANNERS}

    def choices(
        self, context: PlanningContext, situation: Situation, rng: np.random.Generator
    ) -> dict[str, int | None]:
        """An object's id by the name of a baseline; None where it names none. `first` names the first object of all,
        by its id, which is to mean nothing; the other three plain ones go by the graspable.
        """
        graspable = context.graspable_ids
        found: dict[str, int | None] = {
            "random": int(rng.choice(graspable)) if graspable else None,
            "first": min(context.scene.ids, default=None),
            "largest": largest(context),
            "nearest": nearest(context),
        }
        for name, planner in self._planners.items():
            found[name] = planner.decide(context, np.random.default_rng(0)).object_id
        repeat = int(rng.integers(_REPEATS))
        for accuracy in ACCURACIES:
            found[f"simulated-{accuracy}"] = _simulated(context, lambda: situation, accuracy, repeat)
        return found


def largest(context: PlanningContext) -> int | None:
    """Of what is graspable, the object with the most pixels; None where nothing is."""
    graspable = context.graspable_ids
    return max(graspable, key=lambda k: (context.scene.object(k).pixel_count, -k), default=None)


def nearest(context: PlanningContext) -> int | None:
    """Of what is graspable, the object nearest to the camera; None where nothing is."""
    return min(context.graspable_ids, key=lambda k: (_distance(context, k), k), default=None)


def _distance(context: PlanningContext, object_id: int) -> float:
    """Metres from the camera to the middle of what it sees of an object."""
    seen = context.scene.object(object_id).pixels
    if not len(seen):
        return float("inf")
    return float(np.median(context.scene.observation.depth_m[seen[:, 0], seen[:, 1]]))


def _simulated(
    context: PlanningContext, truth: Callable[[], Situation], accuracy: str, repeat: int
) -> int | None:
    """The simulated VLM is told the grasp facts, as VLM+GRASPS, and asked once."""
    client = SimulatedVlm(find_profile(accuracy), truth)
    facts = "\n".join(grasp_facts(context))
    reply = client.ask(Question(facts, (), PLAN_SCHEMA, repeat))
    return read_number(reply.text, context.scene.ids)
