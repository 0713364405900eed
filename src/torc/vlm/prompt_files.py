"""Prompts as files, shipped and user-defined, in one format and checked before anything is asked.

A YAML file has its `format` and `user`, the text with $fields, and may have `system`, `examples` of questions and
replies, and two endings, of which one is appended to `user`: `free_text` where only the prompt asks for JSON, `schema`
where the server holds the reply to a JSON schema. A .txt file is `user` alone.
"""

from dataclasses import asdict
from pathlib import Path
from string import Template
from typing import Annotated, Any, Literal

import yaml
from pydantic import AfterValidator, BaseModel, Field

from torc.errors import InputError, UnknownNameError
from torc.io.reading import read_text
from torc.io.strict_yaml import parse_plain_yaml, validated
from torc.vlm.prompt import Example, Prompt

FORMAT = "torc-prompt/1"
ENDINGS = (".yaml", ".yml", ".txt")
_MAX_BYTES = 400_000
_REMEDY = "docs/vlm.md shows one (Prompts of your own)."


def _template(text: str) -> str:
    if not Template(text).is_valid():
        raise ValueError("has a $ that begins no field; write $$ for a dollar sign")
    return text


_Text = Annotated[str, Field(max_length=9_000), AfterValidator(_template)]


class _Example(BaseModel, extra="forbid", str_strip_whitespace=True):
    user: str = Field(min_length=1, max_length=9_000)
    reply: str = Field(min_length=1, max_length=9_000)


class _PromptFile(BaseModel, extra="forbid", str_strip_whitespace=True):
    format: Literal["torc-prompt/1"]
    user: _Text = Field(min_length=1)
    system: _Text = ""
    free_text: _Text = ""
    schema_: _Text = Field(default="", alias="schema")
    examples: list[_Example] = Field(default=[], max_length=20)


def load_prompt(path: Path) -> Prompt:
    """Load a prompt from a file, or the shipped one of that name. Raises InputError naming file and field."""
    if path.suffix not in ENDINGS:
        if path.name == str(path) and not path.exists():
            return shipped_prompt(str(path))
        raise InputError(f"'{path}' is no prompt: its name must end in {' or '.join(ENDINGS)}. {_REMEDY}")
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"The prompt '{path}' cannot be read: {error}. {_REMEDY}") from None
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
    content: Any = {"format": FORMAT, "user": text}
    if not plain:
        content = parse_plain_yaml(text, source, "prompt", _MAX_BYTES, _REMEDY)
    found = validated(_PromptFile, content, f"{source} is not a valid prompt file", _REMEDY)
    return Prompt(
        name,
        found.user,
        found.system,
        found.free_text,
        found.schema_,
        tuple(Example(e.user, e.reply) for e in found.examples),
    )


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
    return tuple(sorted(_shipped()))


def shipped_prompt(name: str) -> Prompt:
    """Return the shipped prompt of that name. Raises UnknownNameError for an unknown name.

    A changed prompt is a new file with the next number, because results name theirs.
    """
    paths = _shipped()
    if name not in paths:
        raise UnknownNameError("prompt", name, [*sorted(paths)], ", or a file that ends in .yaml or .txt")
    return load_prompt(paths[name])


def _shipped() -> dict[str, Path]:
    folder = Path(__file__).with_name("prompts")
    return {path.stem: path for path in folder.iterdir() if path.suffix in ENDINGS}


class _Dumper(yaml.SafeDumper):
    """Writes texts of several lines as blocks, for people."""


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.Node:
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style="|" if "\n" in value else None)


_Dumper.add_representer(str, _text)
