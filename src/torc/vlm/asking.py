"""Asks a model about a scene until an answer is of use, at most three times (the authors' rule)."""

import hashlib
from collections.abc import Callable, Mapping
from importlib.resources import files
from string import Template
from typing import Any, TypeVar

import numpy as np

from torc.errors import InputError
from torc.perception.marking import mark_image
from torc.records import TARGET_ID, Decision, Exchange, PlanningContext
from torc.records.files import png_bytes
from torc.records.serialization import to_plain
from torc.task_planning.protocol import MAX_ATTEMPTS
from torc.vlm.answers import Useless
from torc.vlm.protocol import Question, Reply, VlmClient
from torc.vlm.replies import ask_client

Answer = TypeVar("Answer")
_SEEDS = 2**31
_MAX_NAME = 60


def checked_client(client: VlmClient | None, planner: str) -> VlmClient:
    """The client. Raises InputError if there is none: a planner that asks a model was named without one."""
    if client is None:
        raise InputError(
            f"Task planner '{planner}' asks a VLM: say which with --vlm gemini:MODEL, anthropic:MODEL, openai:MODEL, "
            "openai:MODEL@URL for a server of your own, or, in a simulated trial, simulated."
        )
    return client


def consult(
    client: VlmClient,
    context: PlanningContext,
    prompt_name: str,
    values: Mapping[str, object],
    schema: Mapping[str, Any],
    read: Callable[[Reply], Answer | Useless],
    rng: np.random.Generator,
) -> tuple[Answer | Useless, str, Decision]:
    """Ask about the marked image of a scene; ask the same again while `read` finds the reply useless. Each asking draws
    its repetition from rng, so that another seed or pick asks anew. Raises VlmError if the server gives no reply.

    Returns the answer, the model that gave it, and a decision for nothing with all that was asked and answered.
    """
    prompt = filled_prompt(prompt_name, context.scene.target_id is not None, **values)
    image = png_bytes(mark_image(context.scene))
    exchanges: list[Exchange] = []
    tries: list[dict[str, Any]] = []
    answer: Answer | Useless = Useless("It was not asked.")
    model = ""
    for _ in range(MAX_ATTEMPTS):
        reply = ask_client(client, Question(prompt, (image,), schema, int(rng.integers(_SEEDS))))
        answer = read(reply)
        # As its server tells it, short and harmless in a sentence.
        model = "".join(c for c in reply.model_version if c.isprintable())[:_MAX_NAME]
        exchanges.append(Exchange(prompt, reply.text))
        tries.append(_try_facts(reply, answer))
        if not isinstance(answer, Useless):
            break
    digest = hashlib.sha256(image).hexdigest()
    evidence = {"vlm": {"prompt": prompt_name, "image_sha256": digest, "tries": tries}}
    last = answer.reason if isinstance(answer, Useless) else ""
    reason = f"The VLM {model} gave no answer of use in {len(tries)} tries. {last}"
    nothing = Decision(None, reason, len(tries), exchanges=tuple(exchanges), evidence=evidence)
    return answer, model, nothing


def filled_prompt(name: str, target_visible: bool, **values: object) -> str:
    """The prompt of that name for a scene whose target is in sight, or not; `values` fills what else it asks for."""
    if target_visible:
        state = "It is in sight."
    else:
        state = f"It is not in sight: nothing in the picture carries the number {TARGET_ID}."
    return fill_prompt(name, target=TARGET_ID, target_state=state, **values)


def _try_facts(reply: Reply, answer: object) -> dict[str, Any]:
    """A try as plain data. "seconds": wall times stand under that name only, so that logs can be compared."""
    return {
        "useless": answer.reason if isinstance(answer, Useless) else None,
        "finish": reply.finish.value,
        "model_version": reply.model_version,
        "tokens": to_plain(reply.tokens),
        "seconds": round(reply.latency_s, 4),
    }


def fill_prompt(name: str, **values: object) -> str:
    """The prompt file of that name with its $placeholders filled. Raises KeyError for one that is left open. A changed
    prompt is a new file with the next number; results name theirs.
    """
    text = (files("torc.vlm") / "prompts" / f"{name}.txt").read_text(encoding="utf-8")
    return Template(text).substitute(values).strip()
