"""Prompts as files, shipped and user-defined, in one format and checked before anything is asked.

A YAML file has its `format` and `user`, the text with $fields, and may have `system`, `examples` of questions and
replies, and two endings, of which one is appended to `user`: `free_text` where only the prompt asks for JSON, `schema`
where the server holds the reply to a JSON schema. A .txt file is `user` alone.
"""

from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any, Literal

import yaml
from pydantic import BaseModel, Field, ValidationError

from torc.errors import InputError, UnknownNameError
from torc.io.reading import read_text
from torc.io.strict_yaml import explain_faults, parse_plain_yaml
from torc.vlm.prompt import Example, Prompt

FORMAT = "torc-prompt/1"
MAX_CHARACTERS = 9_000
"""Limit for each text."""
MAX_EXAMPLES = 20
ENDINGS = (".yaml", ".yml", ".txt")
_MAX_BYTES = 400_000
_REMEDY = "docs/vlm.md shows one (Prompts of your own)."


class _ExampleEntry(BaseModel, extra="forbid"):
    user: str = Field(min_length=1, max_length=MAX_CHARACTERS)
    reply: str = Field(min_length=1, max_length=MAX_CHARACTERS)


class _PromptFile(BaseModel, extra="forbid"):
    """The whole file."""

    format: Literal["torc-prompt/1"]
    user: str = Field(min_length=1, max_length=MAX_CHARACTERS)
    system: str = Field(default="", max_length=MAX_CHARACTERS)
    free_text: str = Field(default="", max_length=MAX_CHARACTERS)
    schema_: str = Field(default="", max_length=MAX_CHARACTERS, alias="schema")
    examples: list[_ExampleEntry] = Field(default=[], max_length=MAX_EXAMPLES)


def load_prompt(path: Path) -> Prompt:
    """Load a prompt from a file, or the shipped one of that name. Raises InputError naming file and field."""
    if path.suffix not in ENDINGS:
        if path.name == str(path) and not path.exists():
            return shipped_prompt(str(path))
        raise InputError(f"'{path}' is no prompt: its name must end in {' or '.join(ENDINGS)}. {_REMEDY}")
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise InputError(f"'{path}' is larger than {_MAX_BYTES:,} bytes: no prompt.")
        text = read_text(path)
    except OSError as error:
        raise InputError(f"The prompt '{path}' cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"The prompt '{path}' is no text in UTF-8.") from None
    return parse_prompt(text, path.stem, str(path), plain=path.suffix == ".txt")


def parse_prompt(text: str, name: str, source: str, *, plain: bool = False) -> Prompt:
    """Read a prompt from the text of a file.

    Args:
        text: the file's content.
        name: the prompt's name.
        source: names the file in errors.
        plain: the text is that of a .txt.

    Raises:
        InputError: the message names the field.
    """
    content: Any = (
        {"format": FORMAT, "user": text}
        if plain
        else parse_plain_yaml(text, source, "prompt", _MAX_BYTES, _REMEDY)
    )
    try:
        found = _PromptFile.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{source} is not a valid prompt. {_REMEDY}\n{explain_faults(error)}") from None
    examples = tuple(Example(e.user.strip(), e.reply.strip()) for e in found.examples)
    texts = (found.user, found.system, found.free_text, found.schema_)
    user, system, free_text, schema = (t.strip() for t in texts)
    for where, part in (("user", user), ("system", system), ("free_text", free_text), ("schema", schema)):
        if not Template(part).is_valid():
            raise InputError(
                f"{source}: {where} has a $ that begins no field. Write $$ for a dollar sign. {_REMEDY}"
            )
    if not user:
        raise InputError(f"{source}: user is empty. {_REMEDY}")
    return Prompt(name, user, system, free_text, schema, examples)


def prompt_text(prompt: Prompt) -> str:
    """Return the YAML file of a prompt; `parse_prompt` reads it back."""
    texts = {k: v for k, v in asdict(prompt).items() if v and k not in ("name", "examples")}
    examples = {"examples": [asdict(e) for e in prompt.examples]} if prompt.examples else {}
    return yaml.dump(
        {"format": FORMAT, **texts, **examples},
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        width=2**16,
    )


def shipped_names() -> tuple[str, ...]:
    found = (files("torc.vlm") / "prompts").iterdir()
    return tuple(sorted(Path(f.name).stem for f in found if Path(f.name).suffix in ENDINGS))


def shipped_prompt(name: str) -> Prompt:
    """Return the shipped prompt of that name. Raises UnknownNameError for an unknown name.

    A changed prompt is a new file with the next number, because results name theirs.
    """
    if name not in shipped_names():
        raise UnknownNameError("prompt", name, [*shipped_names()], ", or a file that ends in .yaml or .txt")
    for ending in ENDINGS:
        file = files("torc.vlm") / "prompts" / f"{name}{ending}"
        if file.is_file():
            text = file.read_text(encoding="utf-8")
            return parse_prompt(text, name, file.name, plain=ending == ".txt")
    raise FileNotFoundError(name)


class _Dumper(yaml.SafeDumper):
    """Writes texts of several lines as blocks, for people."""


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.Node:
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style="|" if "\n" in value else None)


_Dumper.add_representer(str, _text)
