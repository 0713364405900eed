"""Examples for fine-tuning and preference pairs, as a Hugging Face imagefolder: pictures, and a line for each.

An example for supervised fine-tuning is the marked image, VLM-SELECT's prompt, and the answer that brought success. A
preference pair is a look at which the choice of ORACLE or a person differs from another planner's.
"""

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torc.episode.log import LookedLine
from torc.episode.recorded import RecordedPick, RecordedTrial
from torc.exports.selection import EXPERTS, SPLITS, Source, split_of, succeeded
from torc.vlm.asker import filled_prompt
from torc.vlm.config import DEFAULT_QUESTIONS
from torc.vlm.planners import VlmSelectPlanner

PROMPT = f"{VlmSelectPlanner.form.planner}-{DEFAULT_QUESTIONS}"
"""Name of the exported prompt: VLM-SELECT's."""
_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]+")
_State = tuple[str, int, str, tuple[int, ...]]
_Choices = dict[int, tuple[Source, int]]
"""Chosen object -> the first trial and pick that chose it."""


def chosen_object(pick: RecordedPick) -> int | None:
    """Return the object that the planner chose, if it is in the picture; otherwise no answer can name it."""
    chosen = pick.decided.object_id if pick.decided is not None else None
    return chosen if chosen in {o.id for o in pick.looked.objects} else None


def answer_text(trial: RecordedTrial, number: int) -> str:
    """Return the plan that the trial followed from that pick on, in the form that the prompt asks for.

    It begins with the object chosen then. Of the later picks it names those that brought out an object in this picture
    (or the target): others have no number there.
    """
    pick = trial.pick(number)
    looked, chosen = pick.looked, chosen_object(pick)
    if chosen is None:
        raise ValueError(f"Pick {number} of {trial.directory} names no object in the picture.")
    order, nameable = [chosen], {o.id for o in looked.objects} | {looked.target_id}
    for later in trial.picks[number + 1 :]:
        if order[-1] == looked.target_id:
            break
        brought = later.executed.object_id if later.executed is not None and succeeded(later) else None
        if brought in nameable - {*order}:
            order.append(brought)
    plan = [{"action": "pick" if k == looked.target_id else "remove", "input": k} for k in order]
    answer = {"thoughts": thoughts(looked, chosen), "plan": plan}
    return f"```json\n{json.dumps(answer)}\n```"


def thoughts(looked: LookedLine, chosen: int) -> str:
    """Explain in a few sentences, from the robot's sensors, why that object comes first.

    The planner's own reasons are not used: many refer to what no picture shows.
    """
    target_id = looked.target_id
    target = f"object {target_id}"
    if chosen == target_id:
        return f"The target, {target}, is in sight and can be grasped, so I pick it at once."
    blockers = sorted({b.by for b in looked.blocking if b.object == target_id and b.by != target_id})
    if not looked.target_visible:
        state = f"The target, {target}, is not in sight, so what may hide it has to go first."
    elif target_id in looked.graspable:
        state = f"The target, {target}, is in sight and could be grasped."
    elif blockers:
        *some, last = map(str, blockers)
        who = f"objects {', '.join(some)} and {last} are" if some else f"object {last} is"
        state = f"The target, {target}, is in sight, but {who} in the way of the robot's hand."
    else:
        state = f"The target, {target}, is in sight, but cannot be grasped as it lies."
    can = "can be grasped now" if chosen in looked.graspable else "comes first"
    return f"{state} Object {chosen} {can}, so I remove it."


@dataclass(frozen=True)
class Row:
    """One example.

    Attributes:
        split, problem: where it belongs.
        name, picture: its picture, a PNG.
        facts: the other columns, the same for every row.
        sources: the trials that it was made from.
    """

    split: str
    problem: str
    name: str
    picture: bytes
    facts: dict[str, Any]
    sources: tuple[Source, ...]


def finetuning_rows(sources: Iterable[Source], every: bool, test_share: float) -> Iterator[Row]:
    """Yield a row per pick that brought the chosen object out; per pick with any answer, if `every`."""
    for source in sources:
        trial = source.trial
        for number, pick in enumerate(trial.picks):
            chosen = chosen_object(pick)
            if chosen is None or not (every or succeeded(pick)):
                continue
            executed = pick.executed
            yield Row(
                split=split_of(source.problem, test_share),
                problem=source.problem,
                name=f"{source.problem}-{source.key}-{number:02d}",
                picture=trial.picture(number),
                facts={
                    "pick": number,
                    "prompt": filled_prompt(PROMPT, pick.looked.target_id, pick.looked.target_visible),
                    "answer": answer_text(trial, number),
                    "prompt_name": PROMPT,
                    "object_id": chosen,
                    "planner": trial.spec.planner.name,
                    "expert": trial.spec.planner.expert,
                    "seed": trial.spec.seed,
                    "result": executed.result if executed is not None else "",
                    "drops": len(executed.dropped) if executed is not None else 0,
                    "retrieved": source.retrieved,
                },
                sources=(source,),
            )


def preference_rows(sources: Iterable[Source], test_share: float) -> Iterator[Row]:
    """Yield a row for each pair of differing choices of an expert and another planner at one look.

    Looks are equal if problem, seed, digest of the outputs of camera and grasp planner, and graspable objects are; only
    trials with the same picks so far reach that. An expert's pick counts if it brought the object out, in a trial that
    retrieved the target; another planner's always counts if it named an object in the picture.
    """
    experts: dict[_State, _Choices] = {}
    others: dict[_State, _Choices] = {}
    for source in sources:
        expert = source.planner in EXPERTS
        for number, pick in enumerate(source.trial.picks):
            chosen = chosen_object(pick)
            if chosen is None or not pick.looked.digest:
                continue
            if expert and not (source.retrieved and succeeded(pick)):
                continue
            state = (source.problem, source.trial.spec.seed, pick.looked.digest, pick.looked.graspable)
            (experts if expert else others).setdefault(state, {}).setdefault(chosen, (source, number))
    for state, choices in experts.items():
        rejected = others.get(state, {})
        for good, (source, number) in choices.items():
            for bad, (other, other_number) in rejected.items():
                if bad in choices:
                    continue
                looked = source.trial.pick(number).looked
                facts = {
                    "pick": number,
                    "prompt": filled_prompt(PROMPT, looked.target_id, looked.target_visible),
                    "chosen": answer_text(source.trial, number),
                    "rejected": answer_text(other.trial, other_number),
                    "prompt_name": PROMPT,
                    "chosen_id": good,
                    "rejected_id": bad,
                    "chosen_by": source.planner,
                    "rejected_by": other.planner,
                    "expert": source.trial.spec.planner.expert,
                    "seed": source.trial.spec.seed,
                }
                name = f"{source.problem}-{source.key}-{number:02d}-{good}-{bad}"
                split = split_of(source.problem, test_share)
                picture = source.trial.picture(number)
                yield Row(split, source.problem, name, picture, facts, (source, other))


def write_rows(directory: Path, rows: Iterator[Row]) -> dict[str, int]:
    """Write `<split>/<name>.png` and `<split>/metadata.jsonl`; return the number of rows of each split."""
    counts = dict.fromkeys(SPLITS, 0)
    for row in rows:
        folder = directory / row.split
        folder.mkdir(exist_ok=True)
        file_name = _UNSAFE.sub("-", row.name) + ".png"
        (folder / file_name).write_bytes(row.picture)
        line = {"file_name": file_name, "problem": row.problem, **row.facts}
        with open(folder / "metadata.jsonl", "a", encoding="utf-8") as stream:
            stream.write(json.dumps(line) + "\n")
        counts[row.split] += 1
    return counts
