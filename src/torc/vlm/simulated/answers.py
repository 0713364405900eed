"""The simulated VLM's answers as text: thoughts, then fenced JSON; or what a failing model writes instead."""

import json
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from torc.records import MAX_OBJECTS, TARGET_ID
from torc.task_planning.graph import EdgeKind
from torc.vlm.protocol import Finish
from torc.vlm.simulated.confusion import ToldFacts
from torc.vlm.simulated.situation import Pair, Situation

_GRASPABLE = re.compile(r"^Object (\d+) is graspable\.$", re.MULTILINE)
_BLOCKED = re.compile(r"^Object (\d+) is blocked by object (\d+)\.$", re.MULTILINE)
_CANDIDATE = re.compile(r'\{"source": (\d+), "relation": "behind", "target": (\d+)\}')
_SPOILT = (
    ("I am sorry, I cannot help with that.", Finish.REFUSED),
    ("", Finish.EMPTY),
    ("It is hard to tell. I would begin with the object in front.", Finish.COMPLETE),
    ('```json\n{"thoughts": "There are several objects, and', Finish.TRUNCATED),
    ('```json\n{"objects": ["red can", "blue box"]}\n```', Finish.COMPLETE),
)
"""What comes instead of an answer."""


def told_facts(prompt: str) -> ToldFacts | None:
    """What a prompt says on grasps; None if it says nothing."""
    graspable = frozenset(map(int, _GRASPABLE.findall(prompt)))
    blocks = frozenset((int(b), int(a)) for a, b in _BLOCKED.findall(prompt))
    return ToldFacts(graspable, blocks) if graspable or blocks else None


def candidate_pairs(prompt: str) -> tuple[Pair, ...]:
    """The (source, target) pairs that a prompt asks to correct."""
    return tuple((int(s), int(t)) for s, t in _CANDIDATE.findall(prompt))


def plan_answer(believed: Situation, made_up: int | None) -> dict[str, Any]:
    """A sequence of actions. `made_up` takes the place of its first object."""
    order = list(believed.removal_order())
    if made_up is not None:
        order[:1] = [made_up]
    plan = [{"action": "pick" if k == TARGET_ID else "remove", "input": k} for k in order]
    return {"thoughts": _thoughts(believed), "plan": plan}


def relations_answer(believed: Situation, candidates: Sequence[Pair], made_up: int | None) -> dict[str, Any]:
    """The candidate pairs corrected, each of which says that its source is behind its target."""
    entries = []
    for source, target in candidates:
        if (target, source) in believed.lies_on:
            entries.append(_relation(source, EdgeKind.BELOW, target))
        elif (source, target) in believed.lies_on:
            entries.append(_relation(target, EdgeKind.BELOW, source))
        elif (target, source) in believed.hides or (target, source) in believed.blocks:
            entries.append(_relation(source, EdgeKind.BEHIND, target))
    if made_up is not None and candidates:
        entries.insert(0, _relation(made_up, EdgeKind.BEHIND, candidates[0][1]))
    return {"thoughts": _thoughts(believed), "relations": entries}


def answer_text(answer: Mapping[str, Any], signature: str) -> str:
    """A reply as models write it: a word before, then the fenced answer."""
    return f"{signature}\n\n```json\n{json.dumps(answer)}\n```"


def spoilt_text(luck: float, signature: str) -> tuple[str, Finish]:
    """A reply that cannot be read, by a number in [0, 1)."""
    text, finish = _SPOILT[int(luck * len(_SPOILT))]
    return (f"{signature}\n\n{text}" if text else ""), finish


def made_up_id(in_sight: Collection[int], luck: float) -> int | None:
    """An id that nothing in sight carries, by a number in [0, 1); None if all are taken."""
    others = [k for k in range(1, MAX_OBJECTS) if k not in in_sight]
    return others[int(luck * len(others))] if others else None


def _relation(source: int, kind: EdgeKind, target: int) -> dict[str, Any]:
    return {"source": source, "relation": kind.value, "target": target}


def _thoughts(believed: Situation) -> str:
    said = [f"{upper} lies on {lower}." for upper, lower in sorted(believed.lies_on)]
    said += [f"{front} stands in front of {back}." for front, back in sorted(believed.hides)]
    where = "in sight" if believed.target_seen else "not in sight"
    return " ".join([f"I take the target to be {where}.", *said])
