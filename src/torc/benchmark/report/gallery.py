"""Pictures of what went wrong: of failed trials, the pick that failed."""

import base64
import io
from collections import defaultdict, deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from torc.benchmark.report.links import address_of
from torc.benchmark.rows import PickRow, Table, TrialRow
from torc.episode.pictures import COLUMNS, PANEL_WIDTH

_MAX_WIDTH, _JPEG_QUALITY = 480, 78
_MAX_PIXELS = 40_000_000


@dataclass(frozen=True)
class Failure:
    """A failed trial in the gallery.

    Attributes:
        title: planner, problem, seed.
        text: what went wrong.
        address: where the viewer shows that pick; None where there is nothing to show.
        jpeg: the picture of the pick that failed; None where there is none.
    """

    title: str
    text: str
    address: str | None
    jpeg: bytes | None

    @property
    def data_uri(self) -> str:
        """The picture inside a page."""
        return f"data:image/jpeg;base64,{base64.b64encode(self.jpeg or b'').decode()}"


def failures(table: Table, planners: Sequence[str], most: int) -> tuple[list[Failure], int]:
    """At most so many failed trials, planners and causes in turn; and how many there are in all."""
    queues: dict[tuple[str, str], deque[TrialRow]] = defaultdict(deque)
    for planner in planners:
        for row in table.completed(planner):
            if not row.retrieved:
                queues[planner, row.end].append(row)
    count = sum(map(len, queues.values()))
    chosen: list[TrialRow] = []
    while queues and len(chosen) < most:
        for key in list(queues):
            chosen.append(queues[key].popleft())
            if not queues[key]:
                del queues[key]
    return [_failure(table, row) for row in chosen[:most]], count


def _failure(table: Table, row: TrialRow) -> Failure:
    pick = row.failed_pick
    text = f"{row.end} after {row.picks} picks"
    if pick is not None:
        said = f": {pick.detail}" if pick.detail else ""
        text += f". Pick {pick.pick + 1}, object {pick.object_id}: {pick.result}{said}"
    title = f"{row.planner} on {row.problem}, seed {row.seed}"
    address = address_of(table, row, pick.pick if pick else 0)
    return Failure(title, text, address, _picture(row.directory, pick) if pick else None)


def _picture(directory: Path, pick: PickRow) -> bytes | None:
    """The pick's panel of the strip, with choice and outcome; else what the planner saw; else nothing."""
    image: Image.Image | None = None
    with suppress(OSError, ValueError):
        image = _panel(directory / "strip.png", pick.pick)
    with suppress(OSError, ValueError):
        image = image or _opened(directory / "picks" / f"{pick.pick:02d}_seen.png")
    if image is None:
        return None
    image.thumbnail((_MAX_WIDTH, 10 * _MAX_WIDTH))
    encoded = io.BytesIO()
    image.save(encoded, "JPEG", quality=_JPEG_QUALITY)
    return encoded.getvalue()


def _panel(strip: Path, pick: int) -> Image.Image | None:
    image = _opened(strip)
    columns = min(COLUMNS, image.width // PANEL_WIDTH)
    if columns == 0:
        return None
    # A strip has its panels in rows of COLUMNS; how many rows there are follows from the number of picks.
    picks = len(list((strip.parent / "picks").glob("*_seen.png")))
    rows = max(1, -(-picks // COLUMNS))
    height = image.height // rows
    left, top = (pick % COLUMNS) * PANEL_WIDTH, (pick // COLUMNS) * height
    if left + PANEL_WIDTH > image.width or top + height > image.height:
        return None
    return image.crop((left, top, left + PANEL_WIDTH, top + height))


def _opened(path: Path) -> Image.Image:
    with Image.open(path) as image:
        if image.width * image.height > _MAX_PIXELS:
            raise ValueError("too large a picture")
        return image.convert("RGB")
