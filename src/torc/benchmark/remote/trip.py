"""From the process that receives an errand to its child, which plays it."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Trip:
    """What the child process is told.

    Attributes:
        cargo: of the errand.
        directory: to play in.
        problem: the problem's file; None for problems that come with torc.
        code: directory of the user's modules.
        objects: directory of the user's objects.
    """

    cargo: bytes
    directory: Path
    problem: Path | None
    code: Path
    objects: Path
