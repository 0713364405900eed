"""How the tools' commands end."""

import sys
from typing import Protocol

from torc.errors import InputError, TorcError


class Command(Protocol):
    """One command with its arguments."""

    def run(self) -> None:
        """Do it."""
        ...


def exit_code(command: Command) -> int:
    """Runs a command: 0 when done, 1 on failure, 2 on bad input; what is wrong is printed."""
    try:
        command.run()
    except TorcError as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    return 0
