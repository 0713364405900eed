"""Let planners that ask no model, and simulated models, choose at a look; the data keeps their choices."""

from collections.abc import Mapping
from functools import cache

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


@cache
def _planners() -> Mapping[str, TaskPlanner]:
    return {name: make_planner(name) for name in PLANNERS}


def baseline_choices(
    context: PlanningContext, situation: Situation, rng: np.random.Generator
) -> dict[str, int | None]:
    """Return the chosen object's id by baseline; None for no choice.

    `first` is the lowest id, which should mean nothing; random, largest and nearest choose among the graspable. The
    simulated models get the grasp facts, as VLM+GRASPS, and are asked once.
    """
    graspable = context.graspable_ids
    found: dict[str, int | None] = {
        "random": int(rng.choice(graspable)) if graspable else None,
        "first": min(context.scene.ids, default=None),
        "largest": largest(context),
        "nearest": nearest(context),
    }
    for name, planner in _planners().items():
        found[name] = planner.decide(context, np.random.default_rng(0)).object_id
    question = Question("\n".join(grasp_facts(context)), (), PLAN_SCHEMA, int(rng.integers(_REPEATS)))
    for accuracy in ACCURACIES:
        reply = SimulatedVlm(find_profile(accuracy), lambda: situation).ask(question)
        found[f"simulated-{accuracy}"] = read_number(reply.text, context.scene.ids)
    return found


def largest(context: PlanningContext) -> int | None:
    """Return the graspable object with the most pixels; None if none is graspable."""
    return max(context.graspable_ids, key=lambda k: (context.scene.object(k).pixel_count, -k), default=None)


def nearest(context: PlanningContext) -> int | None:
    """Return the graspable object nearest to the camera; None if none is graspable."""
    return min(context.graspable_ids, key=lambda k: (_distance(context, k), k), default=None)


def _distance(context: PlanningContext, object_id: int) -> float:
    """Return the median depth of the visible part of an object, metres."""
    seen = context.scene.object(object_id).pixels
    if not len(seen):
        return float("inf")
    return float(np.median(context.scene.observation.depth_m[seen[:, 0], seen[:, 1]]))
