"""The target, from the options of a command."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from torc.errors import InputError

if TYPE_CHECKING:
    from torc.perception.protocol import Wanted


def wanted_of(
    description: str, pictures: Sequence[Path], mark: str = "", size_m: tuple[float, float] | None = None
) -> Wanted:
    """Return the target of --target, --reference, --mark and --target-size. Raises InputError, also for none."""
    from torc.perception.protocol import Wanted
    from torc.perception.target import load_pictures

    if not (description or pictures or mark):
        raise InputError(
            "Which object is the target? Give --reference pictures of it, --target its description, or both."
        )
    return Wanted(description, load_pictures(pictures), mark_of(mark), size_m)


def mark_of(text: str) -> tuple[int, ...]:
    """Return the numbers of a pixel or a box; none for "". Raises InputError."""
    try:
        return tuple(int(part) for part in text.split(",")) if text else ()
    except ValueError:
        raise InputError(f"--mark '{text}' is not COLUMN,ROW or LEFT,TOP,RIGHT,BOTTOM in pixels.") from None
