"""A bound on the time of a call that may hang: time-outs of HTTP clients count from one byte to the next."""

import threading
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")


class DeadlineError(Exception):
    """The call did not return in time. It may still run."""


def within(seconds: float, call: Callable[[], Result]) -> Result:
    """The call's result, or what it raised.

    Raises DeadlineError after that many seconds; the call is then left to itself, in a thread that does not keep the
    process alive.
    """
    outcome: list[Result] = []
    raised: list[BaseException] = []

    def run() -> None:
        try:
            outcome.append(call())
        except BaseException as error:  # handed to the caller
            raised.append(error)

    thread = threading.Thread(target=run, daemon=True, name="vlm-request")
    thread.start()
    thread.join(seconds)
    if raised:
        raise raised[0]
    if not outcome:
        raise DeadlineError
    return outcome[0]
