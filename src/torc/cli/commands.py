"""Commands by name: a table of names, looked up before anything of the command itself is parsed or imported."""

import re
import shutil
import sys
import textwrap
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from inspect import cleandoc
from itertools import groupby
from pkgutil import resolve_name
from typing import Any, Protocol, cast, get_type_hints

from torc.errors import InputError, UnknownNameError
from torc.registry.settings import under
from torc.specs.conditions import plain_value

_HELP = ("-h", "--help")
_SETTING = re.compile(r"--([a-z]+)\.([A-Za-z][\w.-]*)(?:=(.*))?", re.DOTALL)
_WIDEST = 100


class Runnable(Protocol):
    """A command with its arguments."""

    def run(self) -> int:
        """Run the command and return its exit code."""
        ...


@dataclass(frozen=True)
class Group:
    """Several commands under one name.

    Attributes:
        about: text above their list.
        commands: by name a line of help, and a class, a further group, or "module:NAME" of either, which is imported
            only when the command is used.
        more: text below the list.
    """

    about: str
    commands: Mapping[str, "Entry"]
    more: str = ""

    def command(self, name: str) -> "type[Any] | Group":
        """Return the class or group of a command. Raises KeyError."""
        _, command = self.commands[name]
        return resolve_name(command) if isinstance(command, str) else command

    def help(self, prog: str) -> str:
        """Return a line per command."""
        width = max(map(len, self.commands))
        lines = [f"  {name:<{width}}   {line}" for name, (line, _) in self.commands.items()]
        more = f"`{prog} COMMAND --help` tells more of each.\n\n{self.more}"
        head = [f"usage: {prog} COMMAND ...\n", filled(self.about)]
        return "\n".join([*head, *lines, "", filled(more).rstrip()])


Entry = tuple[str, type[Any] | Group | str]
"""A command's line of help, and the command. An entry point of the group `torc.commands` names one."""


def parse_command(command: "type[Any] | Group", prog: str, arguments: Sequence[str]) -> Runnable:
    """Return the command that a command line means.

    Exits the process if only help is wanted, or an option is wrong. Raises InputError for an unknown command, and for
    impossible settings or seeds.
    """
    if isinstance(command, Group):
        if not arguments or arguments[0] in _HELP:
            print(command.help(prog), file=sys.stdout if arguments else sys.stderr)
            raise SystemExit(0 if arguments else 2)
        name, *rest = arguments
        if name not in command.commands:
            raise UnknownNameError(f"{prog} command", name, [*command.commands])
        return parse_command(command.command(name), f"{prog} {name}", rest)
    import tyro

    if any(a in _HELP for a in arguments):
        print(filled(cleandoc(command.__doc__ or "")))
    default = {}
    if hasattr(command, "prepared"):
        given, arguments = command.prepared(arguments)
        required = (f.name for f in fields(command) if f.default is MISSING and f.default_factory is MISSING)
        default = {"default": command(**dict.fromkeys(required, tyro.MISSING), **given)}
    plain, settings = _split_settings(arguments)
    shown = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff)
    try:
        parsed = tyro.cli(command, prog=prog, description="", args=plain, config=shown, **default)
    except SystemExit:
        if any(a in _HELP for a in arguments):
            print("\n".join(_choices(_options(command))))
        raise
    if getattr(parsed, "seed", 0) < 0:
        raise InputError("--seed must be at least 0.")
    return cast(Runnable, _with_settings(parsed, settings))


def _options(command: type[Any]) -> set[str]:
    """Return the names of a command's options, those of its parts included."""
    found = set()
    for name, kind in get_type_hints(command).items():
        found |= _options(kind) if is_dataclass(kind) and isinstance(kind, type) else {name}
    return found


def _choices(options: Collection[str]) -> Iterator[str]:
    """Yield the parts that a command's options can name, with a line of help each."""
    from torc.registry.kinds import KINDS
    from torc.registry.loading import part_lines

    for kind in KINDS:
        places = [f"--{name}" for name in (kind.option, f"{kind.option}s") if name in options]
        if kind.in_file:
            places = [f"`driver` of `{kind.option}` in the lab file"] if "lab" in options else []
        for place in places:
            lines = part_lines(kind)
            width = max(map(len, lines), default=0)
            yield _wrapped(f"{place}: one of these, or your own as module:Class or path/to/file.py:Class")
            yield from (_wrapped(line, f"  {name:<{width}}  ") for name, line in lines.items())


def _wrapped(text: str, before: str = "") -> str:
    """Wrap a text at the terminal's width, its lines aligned after the text `before`."""
    return textwrap.fill(text, _width(), initial_indent=before, subsequent_indent=" " * max(len(before), 2))


def _width() -> int:
    return min(shutil.get_terminal_size().columns, _WIDEST)


def filled(text: str) -> str:
    """Wrap a text at the terminal's width: paragraphs filled, indented lines unchanged."""
    wrap = textwrap.TextWrapper(_width(), break_long_words=False, break_on_hyphens=False)
    lines: list[str] = []
    for block in text.split("\n\n"):
        for indented, group in groupby(block.split("\n"), lambda line: line.startswith(" ")):
            some = list(group)
            lines += some if indented else wrap.wrap(" ".join(some))
        lines.append("")
    return "\n".join(lines)


def _split_settings(arguments: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """Return the other arguments, and the settings by dotted path. Raises InputError for one without a value."""
    rest, settings = [], {}
    waiting = iter(arguments)
    for argument in waiting:
        found = _SETTING.fullmatch(argument)
        if found is None:
            rest.append(argument)
            continue
        stage, path, text = found.groups()
        text = next(waiting, None) if text is None else text
        if text is None:
            raise InputError(f"{argument} needs a value.")
        settings[f"{stage}.{path.replace('-', '_')}"] = plain_value(text)
    return rest, settings


def _with_settings(command: Any, settings: Mapping[str, Any]) -> Any:
    """Return a command with these settings in its conditions. Raises InputError for settings that it does not take."""
    if of_planner := under(settings, "planner"):
        if not hasattr(command, "planner_settings"):
            raise InputError(
                "This command takes no settings of a planner; `torc run` and experiment files do."
            )
        command = replace(command, planner_settings=of_planner)
    if of_stages := {k: v for k, v in settings.items() if not k.startswith("planner.")}:
        taking = [f.name for f in fields(command) if hasattr(getattr(command, f.name), "settings")]
        if not taking:
            raise InputError(
                f"This command takes no settings of stages: leave out --{next(iter(of_stages))}."
            )
        spec = getattr(command, taking[0])
        command = replace(command, **{taking[0]: replace(spec, settings={**spec.settings, **of_stages})})
    return command
