"""A fake VLM client: no model, no network, the replies that a test wrote."""

from collections.abc import Sequence

from torc.vlm.protocol import Question, Reply
from torc.vlm.replies import reply_of


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
        return reply_of(text, "fake-scripted")
