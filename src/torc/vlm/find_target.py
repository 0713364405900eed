"""Find the target by its description: a model says which of the numbered objects it is, if any."""

from typing import Any

from torc.drawing.marking import mark_image
from torc.errors import InputError
from torc.io.pictures import png_bytes
from torc.perception.protocol import Perception, Wanted
from torc.records import Exchange, Observation, SegmentedScene
from torc.registry.kinds import PERCEPTIONS, PerceptionTraits
from torc.task_planning.protocol import MAX_ATTEMPTS
from torc.vlm.answers import Useless, whole_number
from torc.vlm.asker import fill_prompt
from torc.vlm.protocol import Question, Reply, VlmClient
from torc.vlm.replies import ask_client

PROMPT = "find-target-1"
SCHEMA = {
    "type": "object",
    "properties": {"thoughts": {"type": "string"}, "number": {"type": ["integer", "null"]}},
    "required": ["thoughts", "number"],
    "additionalProperties": False,
}


class TargetByText(PerceptionTraits):
    """A perception that asks a model for the target, while another one finds and tracks the objects.

    It asks only while the target is unknown, and not again while the same objects are in sight.
    """

    def __init__(self, objects: Perception, client: VlmClient) -> None:
        """Wrap a perception `objects`, which finds the objects; if it recognises a target, that counts."""
        self._objects, self._client = objects, client
        self._refused: frozenset[int] = frozenset()
        self.needs_labels = PERCEPTIONS.traits(objects).needs_labels
        self.exchanges: tuple[Exchange, ...] = ()
        """All prompts and replies so far."""

    def perceive(
        self, observation: Observation, wanted: Wanted, before: SegmentedScene | None, **given: Any
    ) -> SegmentedScene:
        """Return the scene, with the target if the model finds it.

        Raises:
            VlmError: the server gives no reply.
            InputError: there is no description.
        """
        if not wanted.description.strip():
            raise InputError("A model can look for the target only by a description of it: there is none.")
        scene = self._objects.perceive(observation, wanted, before, **given)
        if scene.target_id is not None or not scene.objects or frozenset(scene.ids) <= self._refused:
            return scene
        found, exchanges = find_target(self._client, scene, wanted.description)
        self.exchanges += exchanges
        if found is None:
            self._refused = frozenset(scene.ids)
            return scene
        return scene.with_target(found)


def find_target(
    client: VlmClient, scene: SegmentedScene, description: str
) -> tuple[int | None, tuple[Exchange, ...]]:
    """Ask a model which object is the target.

    Returns:
        The object's id, or None if the model sees no target or gives no usable answer in three tries; and the
        exchanges.

    Raises:
        VlmError: the server gives no reply.
    """
    prompt = fill_prompt(PROMPT, description=description)
    images = png_bytes(scene.observation.rgb), png_bytes(mark_image(scene))
    exchanges: list[Exchange] = []
    for repeat in range(MAX_ATTEMPTS):
        reply = ask_client(client, Question(prompt, images, SCHEMA, repeat))
        exchanges.append(Exchange(prompt, reply.text))
        answer = read_number(reply, scene.ids)
        if not isinstance(answer, Useless):
            return answer, tuple(exchanges)
    return None, tuple(exchanges)


def read_number(reply: Reply, offered: tuple[int, ...]) -> int | Useless | None:
    """Return the number in a reply, if it was offered; None for "none of them"."""
    if not isinstance(reply.answer, dict) or "number" not in reply.answer:
        return Useless("It gave no number.")
    value = reply.answer["number"]
    if value is None or (isinstance(value, str) and value.strip().lower() in ("null", "none", "")):
        return None
    number = whole_number(value)
    return number if number in offered else Useless(f"It names {value!r}, which is no number in the picture.")
