"""Commands by name: a table of names, found before anything of the command itself is parsed or imported."""

import inspect
import sys
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from types import MappingProxyType
from typing import Any, Protocol, cast

import tyro

from torc.cli.help_text import explained, filled
from torc.cli.settings_flags import split_settings, with_settings
from torc.errors import UnknownNameError

_HELP = ("-h", "--help")
_CONFIG = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff)


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

    def __post_init__(self) -> None:
        object.__setattr__(self, "commands", MappingProxyType(dict(self.commands)))

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

    Exits the process where only help is wanted, or an option is wrong. Raises UnknownNameError for a command that there
    is not.
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
    cls, default = explained(command), {}
    if hasattr(command, "prepared"):
        given, plain = command.prepared(plain)
        required = (f.name for f in fields(command) if f.default is MISSING and f.default_factory is MISSING)
        default = {"default": command(**dict.fromkeys(required, tyro.MISSING), **given)}
    parsed = tyro.cli(cls, prog=prog, description="", args=plain, config=_CONFIG, **default)
    return cast(Runnable, with_settings(parsed, settings))
