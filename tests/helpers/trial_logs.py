"""Logs of trials, to be compared."""

import json
from pathlib import Path
from typing import Any

from torc.trials.log import without_seconds


def comparable_log(directory: Path) -> list[dict[str, Any]]:
    """The lines of a trial's log without wall times."""
    lines = (directory / "events.jsonl").read_text().splitlines()
    return [without_seconds(json.loads(line)) for line in lines]
