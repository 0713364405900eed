"""A fake VLM client: no model, no network, the replies that a test wrote."""

from collections.abc import Sequence

from torc.vlm.json_text import find_json
from torc.vlm.protocol import Finish, Question, Reply, Tokens


class ScriptedVlm:
    """Replies with these texts in turn; the last repeats.

    Attributes:
        questions: what it was asked.
    """

    def __init__(self, texts: Sequence[str]) -> None:
        self.texts = list(texts)
        self.questions: list[Question] = []

    def ask(self, question: Question) -> Reply:
        """The next text."""
        text = self.texts[min(len(self.questions), len(self.texts) - 1)]
        self.questions.append(question)
        return Reply(text, find_json(text), Finish.COMPLETE, "fake-scripted", Tokens(), 0.0)
