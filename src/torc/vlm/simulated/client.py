"""The simulated VLM as a client: it reads the prompt like a model, and the simulator's truth instead of the picture."""

import json
import re
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.records import MAX_OBJECTS, TARGET_ID
from torc.records.graph import EdgeKind
from torc.vlm.config import DEFAULT_QUESTIONS, VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.protocol import Finish, Question, Reply
from torc.vlm.replies import reply_of
from torc.vlm.simulated.profiles import Profile, find_profile
from torc.vlm.simulated.situation import Pair, Situation

_GRASPABLE = re.compile(r"^Object (\d+) is graspable(?:\.|: .*)$", re.MULTILINE)
_BLOCKED = re.compile(r"^Object (\d+) is blocked by object (\d+)(?: in .*)?\.$", re.MULTILINE)
_CANDIDATE = re.compile(r'\{"source": (\d+), "relation": "behind", "target": (\d+)\}')
_SPOILT = (
    ("I am sorry, I cannot help with that.", Finish.REFUSED),
    ("", Finish.EMPTY),
    ("It is hard to tell. I would begin with the object in front.", Finish.COMPLETE),
    ('```json\n{"thoughts": "There are several objects, and', Finish.TRUNCATED),
    ('```json\n{"objects": ["red can", "blue box"]}\n```', Finish.COMPLETE),
)
"""Replies without an answer."""


@dataclass(frozen=True)
class Luck:
    """All draws for one reply: uniform numbers in [0, 1) per object or pair, whatever the scene and the profile.

    A fact is right where its number is below the probability of being right on it, so the better of two accuracies is
    right wherever the worse one is.
    """

    target: float
    made_up: float
    malformed: float
    form: float
    grasp: Float[np.ndarray, "o"]
    facts: Float[np.ndarray, "o"]
    below: Float[np.ndarray, "o o"]
    direction: Float[np.ndarray, "o o"]
    front: Float[np.ndarray, "o o"]
    blocking: Float[np.ndarray, "o o"]
    extent: Float[np.ndarray, "o o"]


@dataclass(frozen=True)
class ToldFacts:
    """What a prompt says about grasps: graspable objects, and (blocker, blocked) pairs."""

    graspable: frozenset[int]
    blocks: frozenset[Pair]


def open_simulated(config: VlmConfig, truth: Callable[[], Situation]) -> "SimulatedVlm":
    """Return the simulated VLM of a configuration, whose model is the profile.

    Raises:
        InputError: the profile is unknown, or options of real models are set.
    """
    profile = find_profile(config.model)
    model_alone = replace(config, picture=PictureConfig(), prompt=None, questions=DEFAULT_QUESTIONS)
    if model_alone != VlmConfig(config.provider, config.model):
        raise InputError(
            "The simulated VLM takes a profile alone (--vlm simulated:PROFILE), no address and no model's options."
        )
    return SimulatedVlm(profile, truth)


class SimulatedVlm:
    """A VlmClient that asks nobody: it knows the truth and errs as often as its profile says.

    Its replies pass through the parsers of real replies, so the planners that ask it stay unprivileged. It takes no
    part in comparisons of planners. The question's repetition seeds its draws.
    """

    def __init__(self, profile: Profile, truth: Callable[[], Situation]) -> None:
        self.profile, self._truth = profile, truth

    def ask(self, question: Question) -> Reply:
        """Return an answer, or what a failing model would write. Raises InputError for a user-defined prompt."""
        started = time.perf_counter()
        luck = draw_luck(np.random.default_rng(question.repeat))
        answer = json.dumps(self._answer(question, self._truth(), luck))
        text, finish = f"```json\n{answer}\n```", Finish.COMPLETE
        if luck.malformed < self.profile.malformed:
            text, finish = _SPOILT[int(luck.form * len(_SPOILT))]
        if text:
            text = f"(Simulated VLM, profile {self.profile.name}: no model was asked.)\n\n{text}"
        version = f"simulated:{self.profile.name}"
        return reply_of(text, version, finish, latency_s=time.perf_counter() - started)

    def _answer(self, question: Question, truth: Situation, luck: Luck) -> dict[str, Any]:
        wanted = (question.schema or {}).get("properties", {})
        candidates = candidate_pairs(question.prompt)
        believed = confused(truth, self.profile, luck, candidates, told_facts(question.prompt))
        made_up = _made_up_id(truth.in_sight, luck.form) if luck.made_up < self.profile.made_up else None
        if "plan" in wanted:
            return _plan_answer(believed, made_up)
        if "relations" in wanted:
            return _relations_answer(believed, candidates, made_up)
        raise InputError(
            "The simulated VLM answers the prompts of vlm-select, vlm-grasps and vlm-fixes-dg alone."
        )


def told_facts(prompt: str) -> ToldFacts | None:
    """Return what a prompt says about grasps; None if it says nothing."""
    graspable = frozenset(map(int, _GRASPABLE.findall(prompt)))
    blocks = frozenset((int(b), int(a)) for a, b in _BLOCKED.findall(prompt))
    return ToldFacts(graspable, blocks) if graspable or blocks else None


def candidate_pairs(prompt: str) -> tuple[Pair, ...]:
    """Return the (source, target) pairs that a prompt asks to correct."""
    return tuple((int(s), int(t)) for s, t in _CANDIDATE.findall(prompt))


def _plan_answer(believed: Situation, made_up: int | None) -> dict[str, Any]:
    """Return a sequence of actions; `made_up` replaces its first object."""
    order = list(believed.removal_order())
    if made_up is not None:
        order[:1] = [made_up]
    plan = [{"action": "pick" if k == TARGET_ID else "remove", "input": k} for k in order]
    return {"thoughts": _thoughts(believed), "plan": plan}


def _relations_answer(believed: Situation, candidates: Sequence[Pair], made_up: int | None) -> dict[str, Any]:
    """Correct the candidate pairs, each of which says that its source is behind its target."""
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


def _made_up_id(in_sight: Collection[int], luck: float) -> int | None:
    """Return an id that nothing in sight carries, chosen by a number in [0, 1); None if all are taken."""
    others = [k for k in range(1, MAX_OBJECTS) if k not in in_sight]
    return others[int(luck * len(others))] if others else None


def _relation(source: int, kind: EdgeKind, target: int) -> dict[str, Any]:
    return {"source": source, "relation": kind.value, "target": target}


def _thoughts(believed: Situation) -> str:
    said = [f"{upper} lies on {lower}." for upper, lower in sorted(believed.lies_on)]
    said += [f"{front} stands in front of {back}." for front, back in sorted(believed.hides)]
    where = "in sight" if believed.target_seen else "not in sight"
    return " ".join([f"I take the target to be {where}.", *said])


def draw_luck(rng: np.random.Generator) -> Luck:
    target, made_up, malformed, form = rng.random(4).tolist()
    grasp, facts = rng.random((2, MAX_OBJECTS))
    below, direction, front, blocking, extent = rng.random((5, MAX_OBJECTS, MAX_OBJECTS))
    return Luck(target, made_up, malformed, form, grasp, facts, below, direction, front, blocking, extent)


def confused(
    truth: Situation,
    profile: Profile,
    luck: Luck,
    asked: Collection[Pair] = (),
    told: ToldFacts | None = None,
) -> Situation:
    """Return the situation as a model of that quality believes it to be.

    Args:
        truth: the situation.
        profile: the model's quality.
        luck: the draws for this reply.
        asked: pairs in the prompt's question; the model can err on them as on pairs that meet in the image.
        told: what the prompt says about grasps.
    """
    in_sight = dict(truth.in_sight)
    seen = truth.target_seen == (luck.target < profile.sees_target)
    if seen and not truth.target_seen:
        in_sight[TARGET_ID] = 0
    elif not seen:
        in_sight.pop(TARGET_ID, None)
    pairs = _pairs_in_question(truth, asked)
    hiding = pairs if seen else pairs | {(k, TARGET_ID) for k in truth.in_sight if k != TARGET_ID}
    believed = Situation(
        in_sight=in_sight,
        graspable=frozenset(k for k in in_sight if _free(k not in truth.graspable, luck.grasp[k], profile)),
        lies_on=_lies_on(truth, profile, luck, pairs),
        hides=_hides(truth, profile, luck, hiding),
        blocks=frozenset(p for p in pairs if not _free(p in truth.blocks, luck.blocking[p], profile)),
        near=truth.near,
    )
    return believed if told is None else _heeding(believed, told, profile, luck)


def _pairs_in_question(truth: Situation, asked: Collection[Pair]) -> frozenset[Pair]:
    """Return both directions of all pairs of objects in sight, or the target, on which the model can err."""
    known = {*truth.in_sight, TARGET_ID}
    pairs = {p for p in (*truth.near, *truth.lies_on, *truth.hides, *truth.blocks, *asked) if known >= {*p}}
    return frozenset({*pairs, *((b, a) for a, b in pairs)})


def _free(blocked: bool, luck: float, profile: Profile) -> bool:
    """True if something seems free: blocked but overlooked, or free and recognised."""
    return luck >= profile.blocked if blocked else luck < profile.free


def _lies_on(truth: Situation, profile: Profile, luck: Luck, pairs: frozenset[Pair]) -> frozenset[Pair]:
    """Return (upper, lower) as believed. A wrong direction counts as wrong."""
    found = set()
    for a, b in pairs:
        if a > b:
            continue
        upper = next((p for p in ((a, b), (b, a)) if p in truth.lies_on), None)
        if (upper is not None) != (luck.below[a, b] < profile.below):
            continue
        if upper is None:
            found.add((a, b) if luck.direction[a, b] < 0.5 else (b, a))
        else:
            found.add(upper if luck.direction[a, b] < profile.below else upper[::-1])
    return frozenset(found)


def _hides(truth: Situation, profile: Profile, luck: Luck, pairs: frozenset[Pair]) -> dict[Pair, int]:
    """Return (front, back) -> pixels as believed; a wrongly believed object hides a share of its own extent."""
    found = {}
    for pair in sorted(pairs):
        if (pair in truth.hides) == (luck.front[pair] < profile.front):
            share = luck.extent[pair] * truth.in_sight.get(pair[0], 0)
            found[pair] = truth.hides.get(pair, 1 + int(share))
    return found


def _heeding(believed: Situation, told: ToldFacts, profile: Profile, luck: Luck) -> Situation:
    """Return the situation with the prompt's facts on grasps of the objects for which the model heeds the prompt."""
    heeded = {k for k in believed.in_sight if luck.facts[k] < profile.heeds_facts}
    blocks = {p for p in believed.blocks if p[1] not in heeded} | {p for p in told.blocks if p[1] in heeded}
    graspable = (believed.graspable - heeded) | (told.graspable & heeded)
    return replace(believed, graspable=frozenset(graspable), blocks=frozenset(blocks))
