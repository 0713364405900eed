"""The text of `--help`, so that it reads well at the width of a terminal."""

import ast
import dataclasses
import inspect
import shutil
import textwrap
from itertools import pairwise
from typing import Annotated, Any

import tyro

_WIDEST = 100
_NOT_FLAGS = ("settings", "planner_settings", "own_planners")
"""Fields of commands that are no options: they come from --STAGE.SETTING or an experiment file."""


def filled(text: str) -> str:
    """A text at the terminal's width: paragraphs filled, indented lines as they are."""
    width = min(shutil.get_terminal_size().columns, _WIDEST)
    lines: list[str] = []
    for block in text.split("\n\n"):
        plain: list[str] = []
        for line in [*block.split("\n"), None]:
            if line is not None and not line.startswith(" "):
                plain.append(line)
                continue
            lines += textwrap.wrap(" ".join(plain), width, break_long_words=False, break_on_hyphens=False)
            plain = []
            lines += [] if line is None else [line]
        lines.append("")
    return "\n".join(lines)


def explained(command: type[Any]) -> type[Any]:
    """The command's class, with the docstring of each option, in one paragraph, as its help.

    tyro would take those docstrings itself, but keep their line breaks. Options in groups (dataclasses) count, too.
    """
    docs = {k: v for cls in reversed(command.__mro__[:-1]) for k, v in _field_docs(cls).items()}
    for field in dataclasses.fields(command):
        if isinstance(field.default_factory, type) and dataclasses.is_dataclass(field.default_factory):
            explained(field.default_factory)
        elif field.name in _NOT_FLAGS:
            command.__annotations__[field.name] = Annotated[Any, tyro.conf.Suppress, tyro.conf.Fixed]
        else:
            # A default that says nothing ("None", "False") is not told.
            empty = field.default is None or field.default is False or field.default in ("", ())
            help_ = tyro.conf.arg(help=docs.get(field.name), help_behavior_hint="" if empty else None)
            declared = next(c.__annotations__ for c in command.__mro__ if field.name in c.__annotations__)
            command.__annotations__[field.name] = Annotated[declared[field.name], help_]
    return command


def _field_docs(command: type[Any]) -> dict[str, str]:
    """What stands as a docstring behind each field of a class."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(command))).body[0]
    body = tree.body if isinstance(tree, ast.ClassDef) else []
    docs = {}
    for field, after in pairwise(body):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(after, ast.Expr)
            and isinstance(after.value, ast.Constant)
        ):
            docs[field.target.id] = " ".join(str(after.value.value).split())
    return docs
