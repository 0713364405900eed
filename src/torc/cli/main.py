"""Entry point of the `torc` command: parses, runs, and turns errors into one clear line and an exit code.

A command is imported when it is used, and so are the parts that do its work, so that `torc --help` answers at once.
"""

import io
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import torc
from torc.cli.commands import Entry, Group, Runnable, parse_command
from torc.cli.printing import tell
from torc.errors import InputError, TorcError
from torc.interrupts import ended_like_ctrl_c
from torc.satellites import SATELLITES, not_installed, satellite_of_command

TORC = Group(
    "Find and retrieve one object from clutter, one pick after another.",
    {
        "run": ("one retrieval in simulation, with pictures", "torc.cli.run:RunCommand"),
        "bench": ("task planners against each other on many problems", "torc.cli.bench:BenchCommand"),
        "report": ("which of them is best: a page, figures, tables", "torc.cli.report:ReportCommand"),
        "human": ("choose the objects yourself, in a browser", "torc.cli.pages:HumanCommand"),
        "view": ("look at recorded trials, pick by pick, in a browser", "torc.cli.pages:ViewCommand"),
        "export": ("recorded trials as data to train on", "torc.cli.export:ExportCommand"),
        "decide": ("only the decision, for your own camera's frame", "torc.cli.decide:DecideCommand"),
        "perception": ("how well objects are found in pictures", "torc.cli.perception:PERCEPTION"),
        "problems": ("problems to play: list, make, check, solve them", "torc.cli.problems:PROBLEMS"),
        "objects": ("what can lie on the table; import adds your meshes", "torc.cli.objects:OBJECTS"),
        "robots": ("robots: list them, try one of your own", "torc.cli.robots:ROBOTS"),
        "warm-up": ("compile all kernels once, so that no later run waits", "torc.cli.warm_up:WarmUpCommand"),
        "settings": ("what can be set in each stage", "torc.cli.settings:SettingsCommand"),
        "doctor": ("what is missing on this machine, and how to get it", "torc.cli.doctor:DoctorCommand"),
    },
    "Begin with `torc run`. `torc --version` says which version this is.",
)
COMMANDS = "torc.commands"
"""Group of the entry points by which packages add commands: each names an `Entry`."""
_READER_GONE = 141
"""128 + SIGPIPE, as shells report it for tools that the signal ends."""
_NO_CACHE = (
    "Compiled kernels can be kept neither beside the program nor in your home directory. "
    "Set NUMBA_CACHE_DIR to a directory that you can write to."
)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit the process."""
    # `--planner my_module:MyPlanner` finds a module in the working directory, as `python -m` would.
    sys.path.append(os.getcwd())
    # File names may hold characters that the terminal's encoding lacks: show an escape, never crash.
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        code = _run(sys.argv[1:] if arguments is None else arguments)
        sys.stdout.flush()  # here, where a reader that went away can be detected
    except BrokenPipeError:
        # `torc ... | head`: no message, and none from Python's own flush at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = _READER_GONE
    sys.exit(code)


def parse(arguments: Sequence[str]) -> Runnable:
    """Return the command that a command line means. Exits the process with a message if it means none."""
    name = arguments[0] if arguments else ""
    if name in TORC.commands:
        return parse_command(TORC, "torc", arguments)
    # Asking all installed packages takes 15 ms, which torc's own commands need not wait for.
    from torc.registry.loading import load_object, registered

    added = registered(COMMANDS)
    if name in added:
        line, command = _entry(name, added[name])
        if isinstance(command, str):
            command = load_object(f"The command '{name}'", command)
        return parse_command(Group("", {name: (line, command)}), "torc", arguments)
    if owner := satellite_of_command(name):
        raise not_installed(f"`torc {name}`", owner)
    return parse_command(_with_added(added), "torc", arguments)


def _entry(name: str, load: Callable[[], Any]) -> Entry:
    """Load a command that a package registered. Raises InputError."""
    entry = load()
    if isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[1], type | Group | str):
        return cast(Entry, entry)
    raise InputError(
        f"The command '{name}' must be registered as a pair: its line of help, and a class or a Group."
    )


def _with_added(added: Mapping[str, Callable[[], Any]]) -> Group:
    """Return the table with the commands of installed packages, and a line on those that could be installed."""
    entries: dict[str, Entry] = {}
    for name, load in added.items():
        if name in TORC.commands:
            continue
        try:
            entries[name] = _entry(name, load)
        except InputError as error:
            entries[name] = str(error), Group("", {})
    missing = [s for s in SATELLITES if not {*s.commands} & {*added}]
    more = "; ".join(f"{', '.join(s.commands)} (scripts/setup {s.extra})" for s in missing)
    more = f"Not installed: {more}.\n\n" if more else ""
    return replace(TORC, commands={**TORC.commands, **entries}, more=more + TORC.more)


def _run(arguments: list[str]) -> str | int | None:
    if arguments == ["--version"]:
        print(f"torc {torc.__version__}")
        return 0
    try:
        with ended_like_ctrl_c():
            return parse(arguments).run()
    except SystemExit as ended:  # --help, or a wrong option
        return ended.code
    except KeyboardInterrupt:
        tell("torc: interrupted")
        return 130
    except BrokenPipeError:
        raise
    except (TorcError, OSError, RuntimeError) as error:
        code, text = _told(error)
        tell(f"torc: {text}")
        return code


def _told(error: TorcError | OSError | RuntimeError) -> tuple[int, str]:
    """Return exit code and text of an error. Raises faults of torc itself again."""
    if isinstance(error, TorcError):
        return 2 if isinstance(error, InputError) else 1, str(error)
    if isinstance(error, OSError) and error.filename is not None:
        return 2, f"'{error.filename}' cannot be used: {error.strerror}. Choose another."
    if isinstance(error, OSError):
        return 1, f"{error.strerror or error}. `torc doctor` tells what is missing on this machine."
    # numba says this of the first kernel that is imported.
    if "cannot cache function" in str(error):
        return 2, _NO_CACHE
    if "MUJOCO_GL" in str(error):  # MuJoCo's, when it is imported
        return 2, f"{error}. Unset it, or set it to egl, osmesa or off."
    raise error


if __name__ == "__main__":
    main()
