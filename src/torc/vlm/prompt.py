"""A prompt: what a model is told, but for what is filled in."""

import hashlib
import json
from collections.abc import Collection
from dataclasses import asdict, dataclass
from string import Template

from torc.errors import InputError

_DIGITS = 8


@dataclass(frozen=True)
class Example:
    """A question and the reply that one wishes for."""

    user: str
    reply: str


@dataclass(frozen=True)
class Prompt:
    """What a model is told, but for what is filled in: a file's content, whatever the file is called.

    Attributes:
        name: of the file, without its ending.
        user: the question, with $fields.
        system: instructions before it; may be empty.
        free_text, schema: endings of `user`, see above; if one is empty, `user` stands alone there.
        examples: sent as turns of a conversation before the question, without pictures.
    """

    name: str
    user: str
    system: str = ""
    free_text: str = ""
    schema: str = ""
    examples: tuple[Example, ...] = ()

    @property
    def digest(self) -> str:
        """SHA-256 of all but the name."""
        content = {k: v for k, v in asdict(self).items() if k != "name"}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    @property
    def words(self) -> str:
        """For labels: the name, and the beginning of the digest."""
        return f"prompt {self.name} {self.digest[:_DIGITS]}"

    @property
    def fields(self) -> frozenset[str]:
        """Names of the $fields in its texts."""
        texts = (self.user, self.system, self.free_text, self.schema)
        return frozenset(name for text in texts for name in Template(text).get_identifiers())

    def check(self, planner: str, needed: Collection[str], known: Collection[str]) -> None:
        """Raises InputError if it lacks a field that a planner needs, or has one that it does not fill."""
        for name in sorted(self.fields - set(known)):
            told = ", ".join(f"${k}" for k in sorted(known))
            raise InputError(
                f"Prompt '{self.name}': {planner} fills no ${name}. It fills {told}; write $$ for a dollar sign."
            )
        for name in sorted(set(needed) - self.fields):
            raise InputError(f"Prompt '{self.name}' has no ${name}, without which {planner} cannot ask.")

    def filled(self, structured: bool, **values: object) -> tuple[str, str]:
        """System text and question; `structured`: the server holds the reply to a schema. Raises KeyError for a field
        that is left open.
        """
        ending = self.schema if structured else self.free_text
        question = "\n\n".join(part.strip() for part in (self.user, ending) if part.strip())
        return Template(self.system).substitute(values).strip(), Template(question).substitute(values)
