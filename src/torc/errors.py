"""The errors of torc. Expected failures are values (see `PlanFailure`); these are for everything else.

Every message names what was wrong, where, and what the user can do about it.
"""


class TorcError(Exception):
    """Root of all errors raised on purpose. The command line prints its text and exits, without a traceback."""


class InputError(TorcError):
    """A file, argument or image from outside cannot be used. Exit code 2 on the command line."""


class UnknownNameError(InputError):
    """A name that is not in a registry; lists the valid names and the nearest one."""

    def __init__(self, what: str, name: str, valid: list[str]) -> None:
        import difflib

        near = difflib.get_close_matches(name, valid, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        super().__init__(f"Unknown {what} '{name}'.{hint} Known: {', '.join(sorted(valid))}.")
        self.name = name


class MissingDependencyError(TorcError):
    """An optional library or system package is not installed; the message holds the exact line that installs it."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what} is not available. Install it with: {remedy}")


class PhysicsError(TorcError):
    """The simulation broke (a body too fast, a deep penetration, NaN). The trial is errored, never scored."""
