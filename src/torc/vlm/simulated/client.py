"""The simulated VLM as a client: reads the prompt as a model does, and the picture from the simulator's truth."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from torc.errors import InputError
from torc.vlm.config import VlmConfig
from torc.vlm.protocol import Finish, Question, Reply
from torc.vlm.replies import reply_of
from torc.vlm.simulated.answers import (
    answer_text,
    candidate_pairs,
    made_up_id,
    plan_answer,
    relations_answer,
    spoilt_text,
    told_facts,
)
from torc.vlm.simulated.confusion import Luck, confused, draw_luck
from torc.vlm.simulated.profiles import Profile, find_profile
from torc.vlm.simulated.situation import Situation


def open_simulated(config: VlmConfig, truth: Callable[[], Situation]) -> "SimulatedVlm":
    """The simulated VLM of a configuration, whose model is the profile.

    Raises InputError for a profile that is unknown, and for options of real models.
    """
    profile = find_profile(config.model)
    if config != VlmConfig(config.provider, config.model):
        raise InputError(
            "The simulated VLM takes a profile alone (--vlm simulated:PROFILE), no address and no model's options."
        )
    return SimulatedVlm(profile, truth)


class SimulatedVlm:
    """A VlmClient that asks nobody. It knows the truth and errs as often as its profile says.

    Its replies pass through the same parsers as a model's, so the planners that ask it are as unprivileged as ever.
    It is no participant in a comparison of planners: it is there to run the pipeline offline, and to tell how good a
    model must be before it pays. What it draws is decided by the question's repetition.

    Args:
        profile: how often it errs.
        truth: tells the situation in which it is asked.
    """

    def __init__(self, profile: Profile, truth: Callable[[], Situation]) -> None:
        self.profile, self._truth = profile, truth

    def ask(self, question: Question) -> Reply:
        """An answer, or what a failing model would write.

        Raises InputError for a question that no prompt of the shipped planners asks.
        """
        started = time.perf_counter()
        luck = draw_luck(np.random.default_rng(question.repeat))
        text, finish = self._reply(question, self._truth(), luck)
        return reply_of(
            text, f"simulated:{self.profile.name}", finish, latency_s=time.perf_counter() - started
        )

    def _reply(self, question: Question, truth: Situation, luck: Luck) -> tuple[str, Finish]:
        signature = f"(Simulated VLM, profile {self.profile.name}: no model was asked.)"
        if luck.malformed < self.profile.malformed:
            return spoilt_text(luck.form, signature)
        return answer_text(self._answer(question, truth, luck), signature), Finish.COMPLETE

    def _answer(self, question: Question, truth: Situation, luck: Luck) -> dict[str, Any]:
        wanted = (question.schema or {}).get("properties", {})
        candidates = candidate_pairs(question.prompt)
        believed = confused(truth, self.profile, luck, candidates, told_facts(question.prompt))
        made_up = made_up_id(truth.in_sight, luck.form) if luck.made_up < self.profile.made_up else None
        if "plan" in wanted:
            return plan_answer(believed, made_up)
        if "relations" in wanted:
            return relations_answer(believed, candidates, made_up)
        raise InputError(
            "The simulated VLM answers the prompts of vlm-select, vlm-grasps and vlm-fixes-dg alone."
        )
