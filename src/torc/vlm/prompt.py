"""A prompt: the text that a model is given, with fields to fill in."""

import hashlib
import json
from collections.abc import Collection
from dataclasses import asdict, dataclass
from string import Template

from torc.errors import InputError

_DIGITS = 8


@dataclass(frozen=True)
class Example:
    """A question and the reply to it that is wanted."""

    user: str
    reply: str


@dataclass(frozen=True)
class Prompt:
    """The text that a model is given, with fields to fill in: the content of a file.

    Attributes:
        name: of the file, without its ending.
        user: the question, with $fields.
        system: instructions before it; may be empty.
        free_text, schema: endings of `user`: without and with a JSON schema. If one is empty, `user` stands alone.
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
        """SHA-256 of everything but the name."""
        content = {k: v for k, v in asdict(self).items() if k != "name"}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    @property
    def words(self) -> str:
        """The name and the beginning of the digest, for labels."""
        return f"prompt {self.name} {self.digest[:_DIGITS]}"

    @property
    def fields(self) -> frozenset[str]:
        """Names of the $fields in the texts."""
        texts = (self.user, self.system, self.free_text, self.schema)
        return frozenset(name for text in texts for name in Template(text).get_identifiers())

    def check(self, planner: str, needed: Collection[str], known: Collection[str]) -> None:
        """Raise InputError if the prompt lacks a field that a planner needs, or has one that it does not fill."""
        for name in sorted(self.fields - set(known)):
            told = ", ".join(f"${k}" for k in sorted(known))
            raise InputError(
                f"Prompt '{self.name}': {planner} fills no ${name}. It fills {told}; write $$ for a dollar sign."
            )
        for name in sorted(set(needed) - self.fields):
            raise InputError(f"Prompt '{self.name}' has no ${name}, without which {planner} cannot ask.")

    def filled(self, structured: bool, **values: object) -> tuple[str, str]:
        """Return system text and question with the fields filled. Raises KeyError for a field without a value.

        With `structured`, the server holds the reply to a schema.
        """
        ending = self.schema if structured else self.free_text
        question = "\n\n".join(part.strip() for part in (self.user, ending) if part.strip())
        return Template(self.system).substitute(values).strip(), Template(question).substitute(values)
