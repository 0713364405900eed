"""Commands by name: a table of names, found before anything of the command itself is parsed or imported."""

import ast
import inspect
import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from itertools import groupby, pairwise
from typing import Annotated, Any, Protocol, cast

import tyro

from torc.cli.settings_flags import split_settings, with_settings
from torc.errors import InputError, UnknownNameError

_HELP = ("-h", "--help")
_CONFIG = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff)
_NOT_FLAGS = ("settings", "planner_settings", "own_planners")
"""Fields of commands that are no options: they come from --STAGE.SETTING or an experiment file."""
_WIDEST = 100


class Runnable(Protocol):
    """A command with its arguments."""

    def run(self) -> int:
        """Do it; the exit code."""
        ...


@dataclass(frozen=True)
class Group:
    """Several commands under one name.

    Attributes:
        about: what they have in common; stands above their list.
        commands: name -> what it does in a line, and the command's class or a further group.
        more: stands below the list.
    """

    about: str
    commands: Mapping[str, tuple[str, "type[Any] | Group"]]
    more: str = ""

    def help(self, prog: str) -> str:
        """A line per command."""
        width = max(map(len, self.commands))
        lines = [f"  {name:<{width}}   {line}" for name, (line, _) in self.commands.items()]
        more = f"`{prog} COMMAND --help` tells more of each.\n\n{self.more}"
        return "\n".join(
            [f"usage: {prog} COMMAND ...\n", filled(self.about), *lines, "", filled(more).rstrip()]
        )


def parse_command(command: "type[Any] | Group", prog: str, arguments: Sequence[str]) -> Runnable:
    """The command that a command line means.

    Exits the process where only help is wanted, or an option is wrong. Raises InputError for a command that there is
    not, and for settings or a seed that cannot be.
    """
    if isinstance(command, Group):
        if not arguments or arguments[0] in _HELP:
            print(command.help(prog), file=sys.stdout if arguments else sys.stderr)
            raise SystemExit(0 if arguments else 2)
        name, *rest = arguments
        if name not in command.commands:
            raise UnknownNameError(f"{prog} command", name, [*command.commands])
        return parse_command(command.commands[name][1], f"{prog} {name}", rest)
    if any(a in _HELP for a in arguments):
        print(filled(inspect.cleandoc(command.__doc__ or "")))
    plain, settings = split_settings(arguments)
    default = {}
    if hasattr(command, "prepared"):
        given, plain = command.prepared(plain)
        required = (f.name for f in fields(command) if f.default is MISSING and f.default_factory is MISSING)
        default = {"default": command(**dict.fromkeys(required, tyro.MISSING), **given)}
    _present(command)
    parsed = tyro.cli(command, prog=prog, description="", args=plain, config=_CONFIG, **default)
    if getattr(parsed, "seed", 0) < 0:
        raise InputError("--seed must be at least 0.")
    return cast(Runnable, with_settings(parsed, settings))


def filled(text: str) -> str:
    """A text at the terminal's width: paragraphs filled, indented lines as they are."""
    width = min(shutil.get_terminal_size().columns, _WIDEST)
    wrap = textwrap.TextWrapper(width, break_long_words=False, break_on_hyphens=False)
    lines: list[str] = []
    for block in text.split("\n\n"):
        for indented, group in groupby(block.split("\n"), lambda line: line.startswith(" ")):
            some = list(group)
            lines += some if indented else wrap.wrap(" ".join(some))
        lines.append("")
    return "\n".join(lines)


def _present(command: type[Any]) -> None:
    """Gives tyro the docstrings of the fields as their help, and hides what is no flag.

    tyro would take those docstrings itself, but keep their line breaks, and tell defaults that say nothing ("None").
    """
    docs = {name: doc for cls in reversed(command.__mro__[:-1]) for name, doc in _field_docs(cls).items()}
    for field in fields(command):
        if isinstance(field.default_factory, type) and is_dataclass(field.default_factory):
            _present(field.default_factory)
        elif field.name in _NOT_FLAGS:
            command.__annotations__[field.name] = Annotated[Any, tyro.conf.Suppress, tyro.conf.Fixed]
        else:
            empty = field.default is None or field.default is False or field.default in ("", ())
            help_ = tyro.conf.arg(help=docs.get(field.name), help_behavior_hint="" if empty else None)
            command.__annotations__[field.name] = Annotated[field.type, help_]


def _field_docs(command: type[Any]) -> dict[str, str]:
    """What stands as a docstring behind each field of a class."""
    tree: Any = ast.parse(textwrap.dedent(inspect.getsource(command)))
    docs = {}
    for pair in pairwise(tree.body[0].body):
        match pair:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                docs[name] = " ".join(text.split())
    return docs
