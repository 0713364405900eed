"""Entry point of the `torc` command: parses, runs, and turns errors into one clear line and an exit code.

Imports of the working parts stay inside the commands, so that `torc --help` answers at once.
"""

import os
import sys
from typing import Annotated

import tyro

from torc.cli.decide import DecideCommand
from torc.cli.doctor import DoctorCommand
from torc.cli.problems import ProblemsCommand
from torc.cli.run import RunCommand
from torc.errors import InputError, TorcError

Command = (
    Annotated[RunCommand, tyro.conf.subcommand("run")]
    | Annotated[DecideCommand, tyro.conf.subcommand("decide")]
    | Annotated[ProblemsCommand, tyro.conf.subcommand("problems")]
    | Annotated[DoctorCommand, tyro.conf.subcommand("doctor")]
)

DESCRIPTION = """Find and retrieve one object from clutter, one pick after another.

First steps:
  torc run                      one retrieval in simulation, with pictures
  torc problems list            the problems that come with torc
  torc decide FRAME             only the decision, for a saved RGB-D frame
  torc doctor                   what is missing on this machine, and how to get it
"""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exits the process."""
    # `--planner my_module:MyPlanner` finds a module in the working directory, as `python -m` would.
    sys.path.append(os.getcwd())
    sys.exit(_run(arguments))


def _run(arguments: list[str] | None) -> int:
    config = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff)
    try:
        command = tyro.cli(Command, prog="torc", description=DESCRIPTION, args=arguments, config=config)  # type: ignore[call-overload]
        return command.run()
    except InputError as error:
        return _fail(error, 2)
    except TorcError as error:
        return _fail(error, 1)
    except KeyboardInterrupt:
        print("torc: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader went away (`torc ... | head`): no message, and none from Python's own flush at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _fail(error: TorcError, code: int) -> int:
    print(f"torc: {error}", file=sys.stderr)
    return code


if __name__ == "__main__":
    main()
