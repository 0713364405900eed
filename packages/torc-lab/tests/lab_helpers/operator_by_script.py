"""A person beside the robot, by a script."""

from collections.abc import Callable, Mapping

from torc_lab.person import Person

Reply = bool | str
"""To a question of yes or no, or to one that is answered with a line."""


class ScriptedOperator:
    """Answers questions by a part of their text.

    Attributes:
        questions: all that were asked so far.
        said: all that was told.
    """

    def __init__(self, replies: Mapping[str, Reply | Callable[[], Reply]]) -> None:
        """replies: by a part of the question, the first that is in it; a function is called: it may lay a scene out."""
        self._replies = dict(replies)
        self.questions: list[str] = []
        self.said: list[str] = []

    @property
    def person(self) -> Person:
        """As the lab's functions take it."""
        return Person(self._yes, self._line, self.said.append)

    def asked(self, part: str) -> int:
        """How many questions had this in them."""
        return sum(part in question for question in self.questions)

    def _yes(self, question: str) -> bool:
        return self._reply(question, bool)

    def _line(self, question: str) -> str:
        return self._reply(question, str)

    def _reply(self, question: str, kind: type) -> Reply:
        self.questions.append(question)
        reply = next((r for part, r in self._replies.items() if part in question), None)
        answer = reply() if callable(reply) else reply
        if not isinstance(answer, kind):
            raise ValueError(f"The script answers {answer!r} to: {question}")
        return answer
