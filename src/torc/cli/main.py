"""Entry point of the `torc` command: parses, runs, and turns errors into one clear line and an exit code.

Imports of the working parts stay inside the commands, so that `torc --help` answers at once.
"""

import io
import os
import sys
from typing import Annotated

import tyro

import torc
from torc.cli.bench import BenchCommand
from torc.cli.decide import DecideCommand
from torc.cli.doctor import DoctorCommand
from torc.cli.export import ExportCommand
from torc.cli.human import HumanCommand
from torc.cli.objects import ObjectsCommand
from torc.cli.printing import printable
from torc.cli.problems import ProblemsCommand
from torc.cli.report import ReportCommand
from torc.cli.run import RunCommand
from torc.cli.view import ViewCommand
from torc.errors import InputError, TorcError

Command = (
    Annotated[RunCommand, tyro.conf.subcommand("run")]
    | Annotated[BenchCommand, tyro.conf.subcommand("bench")]
    | Annotated[ReportCommand, tyro.conf.subcommand("report")]
    | Annotated[HumanCommand, tyro.conf.subcommand("human")]
    | Annotated[ViewCommand, tyro.conf.subcommand("view")]
    | Annotated[ExportCommand, tyro.conf.subcommand("export")]
    | Annotated[DecideCommand, tyro.conf.subcommand("decide")]
    | Annotated[ProblemsCommand, tyro.conf.subcommand("problems")]
    | Annotated[ObjectsCommand, tyro.conf.subcommand("objects")]
    | Annotated[DoctorCommand, tyro.conf.subcommand("doctor")]
)

DESCRIPTION = """Find and retrieve one object from clutter, one pick after another.

First steps:
  torc run                      one retrieval in simulation, with pictures
  torc bench --out DIR          task planners against each other on many problems; goes on where it was
  torc report DIR               which of them is best, with intervals, as a page and a table
  torc view DIR                 look at recorded trials, pick by pick, in a browser
  torc human structured-03      choose the objects yourself, in a browser
  torc export DIR               recorded trials as data to train on
  torc problems list            the problems that come with torc
  torc objects list             what can lie on the table; `import` adds your own meshes
  torc decide FRAME             only the decision, for a saved RGB-D frame
  torc doctor                   what is missing on this machine, and how to get it
  torc --version                which version this is
"""
_NO_CACHE = (
    "Compiled kernels can be kept neither beside the program nor in your home directory. "
    "Set NUMBA_CACHE_DIR to a directory that you can write to."
)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exits the process."""
    # `--planner my_module:MyPlanner` finds a module in the working directory, as `python -m` would.
    sys.path.append(os.getcwd())
    # Names of files may hold what the terminal's encoding has not: shown as an escape, never a crash.
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    sys.exit(_run(arguments))


def parse(arguments: list[str] | None) -> Command:
    """The command that a command line means. Exits the process with a message where it means none."""
    config = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff)
    return tyro.cli(Command, prog="torc", description=DESCRIPTION, args=arguments, config=config)  # type: ignore[call-overload]


def _run(arguments: list[str] | None) -> int:
    if (sys.argv[1:] if arguments is None else arguments) == ["--version"]:
        print(f"torc {torc.__version__}")
        return 0
    try:
        return parse(arguments).run()
    except InputError as error:
        return _fail(error, 2)
    except TorcError as error:
        return _fail(error, 1)
    except RuntimeError as error:
        # numba says this of the first kernel that is imported; anything else is a fault and shows where it is.
        if "cannot cache function" not in str(error):
            raise
        return _fail(InputError(_NO_CACHE), 2)
    except BrokenPipeError:
        # The reader went away (`torc ... | head`): no message, and none from Python's own flush at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _fail(*_system_fault(error))
    except KeyboardInterrupt:
        print("torc: interrupted", file=sys.stderr)
        return 130


def _system_fault(error: OSError) -> tuple[TorcError, int]:
    """What the machine refused, for the user, and the exit code: a named file is the user's input."""
    if error.filename is not None:
        return InputError(f"'{error.filename}' cannot be used: {error.strerror}. Choose another."), 2
    return TorcError(f"{error.strerror or error}. `torc doctor` tells what is missing on this machine."), 1


def _fail(error: TorcError, code: int) -> int:
    print(f"torc: {printable(str(error))}", file=sys.stderr)
    return code


if __name__ == "__main__":
    main()
