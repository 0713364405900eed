"""A person beside the robot, by a script: for rehearsals without anybody."""

from collections.abc import Callable, Mapping

from torc_lab.person import Person

Reply = bool | str
"""To a question of yes or no, or to one that is answered with a line."""


class ScriptedOperator:
    """Answers questions by a part of their text. Attributes: `questions`, all that were asked so far."""

    def __init__(self, replies: Mapping[str, Reply | Callable[[], Reply]]) -> None:
        """replies: by a part of the question, the first that is in it; a function is called: it may lay a scene out."""
        self._replies = dict(replies)
        self.questions: list[str] = []

    @property
    def person(self) -> Person:
        """As the lab's functions take it."""
        return Person(self._yes, self._line)

    def asked(self, part: str) -> int:
        """How many questions had this in them."""
        return sum(part in question for question in self.questions)

    def _yes(self, question: str) -> bool:
        answer = self._reply(question)
        if not isinstance(answer, bool):
            raise ValueError(f"The script answers {answer!r} to a question of yes or no: {question}")
        return answer

    def _line(self, question: str) -> str:
        answer = self._reply(question)
        if not isinstance(answer, str):
            raise ValueError(f"The script answers {answer!r} where a line is asked for: {question}")
        return answer

    def _reply(self, question: str) -> Reply:
        self.questions.append(question)
        for part, reply in self._replies.items():
            if part in question:
                return reply() if callable(reply) else reply
        raise ValueError(f"The script has no answer to: {question}")
