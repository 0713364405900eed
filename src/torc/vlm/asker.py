"""Ask a model about a scene until its answer is usable, at most three times (the authors' rule)."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from torc.errors import InputError
from torc.io.record_files import to_plain
from torc.records import Decision, Evidence, Exchange, PlanningContext
from torc.records.evidence import ModelEvidence, ModelTry
from torc.task_planning.protocol import MAX_ATTEMPTS
from torc.vlm.answers import Useless
from torc.vlm.config import Asking
from torc.vlm.picture_config import PictureConfig
from torc.vlm.pictures import pictures_of
from torc.vlm.prompt_files import shipped_prompt
from torc.vlm.protocol import Question, Reply, VlmClient
from torc.vlm.question_facts import gripper_sentence, target_size_sentence
from torc.vlm.replies import ask_client

Answer = TypeVar("Answer")
FIELDS = (
    "target",
    "target_state",
    "target_size",
    "description",
    "gripper",
    "history",
    "picks_left",
    "objects",
    "pictures",
)
"""Fields of a prompt that every planner fills, by `prompt_values`."""
_SEEDS = 2**31
_MAX_NAME = 60


@dataclass(frozen=True)
class Form:
    """A planner's form of question.

    Attributes:
        planner: its name, with which the names of its shipped prompts begin.
        needed: the $fields that a user-defined prompt must have.
        own: further $fields that it may have, beside FIELDS.
        schema: JSON schema of the answer.
    """

    planner: str
    needed: Collection[str]
    own: Collection[str]
    schema: Mapping[str, Any]


class Asker:
    """Asks a model a planner's question about scene after scene.

    Raises:
        InputError: the planner was named without a model, or the prompt does not fit the planner.
    """

    def __init__(self, client: VlmClient | None, form: Form, asking: Asking | None) -> None:
        if client is None:
            raise InputError(
                f"Task planner '{form.planner}' asks a VLM: say which with --vlm gemini:MODEL, anthropic:MODEL, "
                "openai:MODEL, openai:MODEL@URL for a server of your own, or, in a simulated trial, simulated."
            )
        self._client, self._form = client, form
        self.asking = asking or Asking()
        self._prompt = self.asking.prompt or shipped_prompt(f"{form.planner}-{self.asking.questions}")
        self._prompt.check(form.planner, form.needed, (*FIELDS, *form.own))

    def consult(
        self,
        context: PlanningContext,
        values: Mapping[str, object],
        read: Callable[[Reply], Answer | Useless],
        rng: np.random.Generator,
    ) -> tuple[Answer | Useless, str, Decision]:
        """Ask about a scene, and repeat the question while `read` finds the reply useless.

        Args:
            context: the scene.
            values: values of the planner's own fields.
            read: returns the answer in a reply, or Useless.
            rng: draws the repetition of each question, so that another seed or pick asks anew.

        Returns:
            The answer, the model that gave it, and an empty Decision that carries the transcript.

        Raises:
            VlmError: the server gives no reply.
        """
        filled = prompt_values(context, self.asking.picture) | dict(values)
        system, question = self._prompt.filled(self.asking.structured, **filled)
        pictures = pictures_of(context.scene, self.asking.picture)
        images = tuple(p.png for p in pictures)
        exchanges: list[Exchange] = []
        tries: list[ModelTry] = []
        answer: Answer | Useless = Useless("It was not asked.")
        model, useless = "", None
        for _ in range(MAX_ATTEMPTS):
            repeat = int(rng.integers(_SEEDS))
            asked = Question(question, images, self._form.schema, repeat, system, self._prompt.examples)
            reply = ask_client(self._client, asked)
            answer = read(reply)
            # As the server reports it, short and safe in a sentence.
            model = "".join(c for c in reply.model_version if c.isprintable())[:_MAX_NAME]
            exchanges.append(Exchange(question, reply.text))
            useless = answer.reason if isinstance(answer, Useless) else None
            seconds = round(reply.latency_s, 4)
            tries.append(ModelTry(useless, reply.finish.value, reply.model_version, reply.tokens, seconds))
            if useless is None:
                break
        shown = tuple(p.facts for p in pictures)
        evidence = ModelEvidence(
            prompt=self._prompt.name,
            prompt_sha256=self._prompt.digest,
            system=system,
            examples=tuple(to_plain(self._prompt.examples)),
            image_sha256=shown[0]["sha256"],
            pictures=shown,
            tries=tuple(tries),
        )
        nothing = Decision(
            None,
            f"The VLM {model} gave no answer of use in {len(tries)} tries. {useless or ''}",
            len(tries),
            exchanges=tuple(exchanges),
            evidence=Evidence(vlm=evidence),
            pictures=images,
        )
        return answer, model, nothing


def prompt_values(context: PlanningContext, picture: PictureConfig) -> dict[str, object]:
    """Return the values of FIELDS for a scene."""
    return {
        "target": context.scene.target_number,
        "target_state": target_state(context.scene.target_id is not None, context.scene.target_number),
        "target_size": target_size_sentence(context),
        "gripper": gripper_sentence(context),
        "description": context.target_description.strip() or "not described",
        "history": "\n".join(_history(context)) or "None so far.",
        "picks_left": context.picks_left,
        "objects": ", ".join(map(str, context.scene.ids)),
        "pictures": picture.sentences,
    }


def target_state(visible: bool, number: int) -> str:
    """Return the sentence in which prompts say whether the target is in sight."""
    if visible:
        return "It is in sight."
    return f"It is not in sight: nothing in the picture carries the number {number}."


def filled_prompt(name: str, target: int, target_visible: bool, **values: object) -> str:
    """Return a shipped prompt that asks for free text; `values` fills the fields other than the target's."""
    return fill_prompt(name, target=target, target_state=target_state(target_visible, target), **values)


def fill_prompt(name: str, **values: object) -> str:
    """Fill a shipped prompt that asks for free text about the paper's picture. Raises KeyError for a missing field."""
    _, question = shipped_prompt(name).filled(False, pictures=PictureConfig().sentences, **values)
    return question


def _history(context: PlanningContext) -> list[str]:
    """Return a line per earlier pick, as the robot felt it."""
    return [
        f"Pick {number}: object {outcome.object_id}, {outcome.result.value}."
        if outcome.object_id >= 0
        else f"Pick {number}: no object, {outcome.result.value}."
        for number, outcome in enumerate(context.history, start=1)
    ]
