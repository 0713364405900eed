"""Check what every VLM client must do, whatever it asks: `check_case(MyClient, case)` for each of CASES, or all at once
with `check_client(MyClient)`. Both raise NonConformanceError, which lists what was broken.

The questions are those of the shipped planners, so a client of a live model needs that model, or a stand-in.
"""

from collections.abc import Callable

import cv2
import numpy as np

from torc.testing.conformance import Case, called_twice, require
from torc.vlm.answers import PLAN_SCHEMA, RELATIONS_SCHEMA
from torc.vlm.failures import VlmError
from torc.vlm.picture_config import PictureConfig
from torc.vlm.prompt import Example
from torc.vlm.prompt_files import shipped_prompt
from torc.vlm.protocol import Question, Reply, VlmClient
from torc.vlm.replies import find_json, reply_faults

_FACTS = "Object 1 is graspable.\nObject 3 is blocked by object 1."
_RELATIONS = '[\n  {"source": 3, "relation": "behind", "target": 1}\n]'
_HIDDEN = "It is not in sight: nothing in the picture carries the number 0."


def sample_png() -> bytes:
    """Return a small picture."""
    image = np.random.default_rng(1).integers(0, 255, (48, 64, 3)).astype(np.uint8)
    return cv2.imencode(".png", image)[1].tobytes()


def _case(name: str, prompt: str, state: str = "It is in sight.", **values: object) -> Case:
    schema = RELATIONS_SCHEMA if "relations" in values else PLAN_SCHEMA
    _, text = shipped_prompt(prompt).filled(
        True, target=0, target_state=state, pictures=PictureConfig().sentences, **values
    )
    return Case(name, lambda: Question(text, (sample_png(),), schema, repeat=3))


def _full_question() -> Question:
    """Return a question with every field set."""
    example = Example("1 is the target. What first?", '{"thoughts": "Free.", "plan": []}')
    prompt = f"{_FACTS}\nWhat first?"
    return Question(prompt, (sample_png(), sample_png()), PLAN_SCHEMA, 3, "Be brief.", (example,))


CASES: tuple[Case, ...] = (
    _case("the plan of VLM-SELECT", "vlm-select-2"),
    _case("the same, target hidden", "vlm-select-2", _HIDDEN),
    _case("the plan of VLM+GRASPS", "vlm-grasps-2", facts=_FACTS),
    _case("the relations of VLM-FIXES-DG", "vlm-fixes-dg-2", relations=_RELATIONS),
    Case("two pictures, a system text and examples", _full_question),
)


def check_client(make: Callable[[], VlmClient], cases: tuple[Case, ...] = CASES) -> None:
    """Run all cases with fresh clients. Raises NonConformanceError with everything that was broken."""
    require("client", [f"{c.name}: {text}" for c in cases for text in _violations(make, c)])


def check_case(make: Callable[[], VlmClient], case: Case) -> None:
    """Run one case. Raises NonConformanceError with everything that was broken."""
    check_client(make, (case,))


def _violations(make: Callable[[], VlmClient], case: Case) -> list[str]:
    question: Question = case.build()
    client = make()
    if not isinstance(client, VlmClient):
        return ["it has no method `ask(question)`"]

    def ask() -> Reply | None:
        try:
            return client.ask(question)
        except VlmError:  # not the client's fault
            return None

    # Twice: a client is asked many times, and one that its first answer closes is useless.
    replies, found = called_twice(ask, question, "the question")
    if not replies:
        found.append("a model that gives no reply is a torc.vlm.failures.VlmError")
    found += [fault for reply in replies if reply is not None for fault in _faults(reply)]
    return found


def _faults(reply: Reply) -> list[str]:
    faults = list(reply_faults(reply))
    if not faults and reply.answer != find_json(reply.text):
        faults.append("answer is not what stands in text; make replies with torc.vlm.replies.reply_of")
    if not faults and not reply.model_version.strip():
        faults.append("model_version is empty; say who answered")
    return faults
