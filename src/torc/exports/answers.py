"""A recorded pick as a question to a vision-language model, and the answer that would have led to it."""

import json

from torc.episode.log_lines import LookedLine
from torc.episode.recorded import RecordedTrial
from torc.exports.selection import succeeded
from torc.records import TARGET_ID
from torc.vlm.asking import filled_prompt
from torc.vlm.select import VlmSelectPlanner

PROMPT = VlmSelectPlanner.prompt
"""Name of the prompt that is exported: VLM-SELECT's."""


def chosen_object(trial: RecordedTrial, number: int) -> int | None:
    """The object that the planner chose in a pick, if it is one in the picture: else no answer can name it."""
    pick = trial.pick(number)
    chosen = pick.decided.object_id if pick.decided is not None else None
    return chosen if chosen in {o.id for o in pick.looked.objects} else None


def prompt_text(trial: RecordedTrial, number: int) -> str:
    """What VLM-SELECT asks before that pick."""
    return filled_prompt(PROMPT, trial.pick(number).looked.target_visible)


def answer_text(trial: RecordedTrial, number: int) -> str:
    """The plan that the trial followed from that pick on, in the form that the prompt asks for.

    It begins with the object chosen then. Of the later picks, it names those that brought out an object which this
    picture shows (or the target): only what has a number in the picture can be named.
    """
    looked, chosen = trial.pick(number).looked, chosen_object(trial, number)
    if chosen is None:
        raise ValueError(f"Pick {number} of {trial.directory} names no object in the picture.")
    order, nameable = [chosen], {o.id for o in looked.objects} | {TARGET_ID}
    for later in trial.picks[number + 1 :]:
        if order[-1] == TARGET_ID:
            break
        brought = later.executed.object_id if later.executed is not None and succeeded(later) else None
        if brought in nameable - {*order}:
            order.append(brought)
    plan = [{"action": "pick" if k == TARGET_ID else "remove", "input": k} for k in order]
    answer = {"thoughts": thoughts(looked, chosen), "plan": plan}
    return f"```json\n{json.dumps(answer)}\n```"


def thoughts(looked: LookedLine, chosen: int) -> str:
    """Why that object first, in a few sentences: what the robot's sensors told, whoever decided.

    A planner's own reasons are not used: many speak of what no picture shows.
    """
    target = f"object {TARGET_ID}"
    if chosen == TARGET_ID:
        return f"The target, {target}, is in sight and can be grasped, so I pick it at once."
    blockers = sorted({b.by for b in looked.blocking if b.object == TARGET_ID and b.by != TARGET_ID})
    if not looked.target_visible:
        state = f"The target, {target}, is not in sight, so what may hide it has to go first."
    elif TARGET_ID in looked.graspable:
        state = f"The target, {target}, is in sight and could be grasped."
    elif blockers:
        *some, last = map(str, blockers)
        who = f"objects {', '.join(some)} and {last} are" if some else f"object {last} is"
        state = f"The target, {target}, is in sight, but {who} in the way of the robot's hand."
    else:
        state = f"The target, {target}, is in sight, but cannot be grasped as it lies."
    can = "can be grasped now" if chosen in looked.graspable else "comes first"
    return f"{state} Object {chosen} {can}, so I remove it."
