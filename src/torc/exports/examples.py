"""Recorded trials as examples: which trials and picks are taken, and what is written of each.

Examples are an imagefolder of Hugging Face: pictures, and a line for each. For supervised fine-tuning these are the
marked image, VLM-SELECT's prompt, and the answer that brought success. A preference pair is a look at which the choice
of ORACLE or a person differs from another planner's.
"""

import hashlib
import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from torc.errors import InputError
from torc.records import PickResult
from torc.trials.log import LookedLine
from torc.trials.recorded import RecordedPick, RecordedTrial, check_directory, find_trials, read_trial
from torc.vlm.asker import filled_prompt
from torc.vlm.config import DEFAULT_QUESTIONS
from torc.vlm.planners import VlmSelectPlanner

SPLITS = ("train", "test")
EXPERTS = ("oracle", "human")
"""Planners whose choices are worth learning: the upper bound, and people."""
PROMPT = f"{VlmSelectPlanner.form.planner}-{DEFAULT_QUESTIONS}"
"""Name of the exported prompt: VLM-SELECT's."""
_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]+")
Counts = dict[str, int]
"""Examples of each split."""
_State = tuple[str, int, str, tuple[int, ...]]
_Choices = dict[int, tuple["Source", int]]
"""Chosen object -> the first trial and pick that chose it."""


@dataclass(frozen=True)
class Source:
    """A recorded trial to export; `key` is a short name, unique below one directory."""

    trial: RecordedTrial
    key: str

    @property
    def problem(self) -> str:
        """The problem's own name, not its file's."""
        started = self.trial.started
        return started.problem if started is not None else Path(self.trial.spec.problem).stem

    def name_of(self, pick: int) -> str:
        return f"{self.problem}-{self.key}-{pick:02d}"

    @property
    def planner(self) -> str:
        return self.trial.spec.planner.name

    @property
    def retrieved(self) -> bool:
        return self.trial.result is not None and self.trial.result.retrieved is True


def select_trials(root: Path, every: bool) -> Iterator[Source]:
    """Yield the completed trials below a directory, by rising path; unless `every`, only those that retrieved the
    target.

    Raises InputError: there is no recorded trial, or one cannot be read.
    """
    check_directory(root)
    directories = sorted(find_trials(root))
    if not directories:
        raise InputError(f"There is no recorded trial in '{root}'. `torc run --out DIR` makes one.")
    for directory in directories:
        trial = read_trial(directory)
        if trial.result is None or trial.result.status != "completed":
            continue
        name = directory.relative_to(root).as_posix()
        source = Source(trial, hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:8])
        if every or source.retrieved:
            yield source


def split_of(problem: str, test_share: float) -> str:
    """Return the split of a problem: by its name alone, so that adding trials and problems moves none."""
    place = int.from_bytes(hashlib.sha256(problem.encode()).digest()[:8]) / 2**64
    return "test" if place < test_share else "train"


def succeeded(pick: RecordedPick) -> bool:
    """True if the pick brought the chosen object out."""
    return pick.executed is not None and pick.executed.result in (PickResult.REMOVED, PickResult.RETRIEVED)


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
    """One example: the name of its picture, a PNG, the other columns, and the trials that it was made from."""

    name: str
    picture: bytes
    facts: dict[str, Any]
    sources: tuple[Source, ...]


def finetuning_rows(sources: Iterable[Source], every: bool) -> Iterator[Row]:
    """Yield a row per pick that brought the chosen object out; per pick with any answer, if `every`."""
    for source in sources:
        trial = source.trial
        for number, pick in enumerate(trial.picks):
            chosen = chosen_object(pick)
            if chosen is None or not (every or succeeded(pick)):
                continue
            executed = pick.executed
            facts = {
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
            }
            yield Row(source.name_of(number), trial.picture(number), facts, (source,))


def preference_rows(sources: Iterable[Source]) -> Iterator[Row]:
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
        rejected = {bad: by for bad, by in others.get(state, {}).items() if bad not in choices}
        for (good, (source, number)), (bad, (other, other_number)) in product(
            choices.items(), rejected.items()
        ):
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
            name = f"{source.name_of(number)}-{good}-{bad}"
            yield Row(name, source.trial.picture(number), facts, (source, other))


def write_rows(directory: Path, rows: Iterable[Row], test_share: float) -> tuple[Counts, list[Source]]:
    """Write `<split>/<name>.png` and `<split>/metadata.jsonl`; return the rows of each split, and the trials used."""
    counts, used = dict.fromkeys(SPLITS, 0), dict[str, Source]()
    for row in rows:
        problem = row.sources[0].problem
        split = split_of(problem, test_share)
        folder = directory / split
        folder.mkdir(exist_ok=True)
        file_name = _UNSAFE.sub("-", row.name) + ".png"
        (folder / file_name).write_bytes(row.picture)
        line = {"file_name": file_name, "problem": problem, **row.facts}
        with open(folder / "metadata.jsonl", "a", encoding="utf-8") as stream:
            stream.write(json.dumps(line) + "\n")
        counts[split] += 1
        used |= {source.key: source for source in row.sources}
    return counts, list(used.values())
