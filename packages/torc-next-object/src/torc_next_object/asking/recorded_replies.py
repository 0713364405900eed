"""Replies on disk, a line of JSON each, appended as they come: a run that was cut off goes on where it was."""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any

from torc import InputError
from torc.io.reading import read_text
from torc.vlm.protocol import Reply
from torc.vlm.replies import MAX_CHARACTERS

NAME = "replies.jsonl"


@dataclass(frozen=True)
class RecordedReply:
    """What a model wrote about a row, and what that took.

    Attributes:
        text: its last characters, all that is ever read.
        finish: how it ended, a `torc.vlm.protocol.Finish`.
        sent, written: tokens; None where the server does not tell. Thinking is part of what is written.
    """

    id: str
    text: str
    finish: str = "complete"
    model_version: str = ""
    sent: int | None = None
    written: int | None = None
    seconds: float = field(default=0.0, compare=False)

    def line(self) -> str:
        """As it stands in the file."""
        facts = {
            "id": self.id,
            "reply": self.text,
            "finish": self.finish,
            "model_version": self.model_version,
        }
        return json.dumps({**facts, "sent": self.sent, "written": self.written, "seconds": self.seconds})


def recorded_reply(row_id: str, reply: Reply) -> RecordedReply:
    """A reply as it is kept."""
    tokens = reply.tokens
    return RecordedReply(
        row_id,
        reply.text[-MAX_CHARACTERS:],
        reply.finish.value,
        reply.model_version,
        tokens.prompt,
        tokens.reply,
        round(reply.latency_s, 3),
    )


class ReplyFile:
    """The replies of one run; `found` are those that were there. A last line that was cut off is forgotten."""

    def __init__(self, directory: Path) -> None:
        self.path = directory / NAME
        self._lock = Lock()
        whole, self.found = _read(self.path)
        if not whole:
            text = "".join(reply.line() + "\n" for reply in self.found.values())
            temporary = self.path.with_name(self.path.name + ".tmp")
            temporary.write_text(text, encoding="utf-8")
            os.replace(temporary, self.path)

    def add(self, reply: RecordedReply) -> None:
        """Append one; it is on the disk when this returns."""
        with self._lock, open(self.path, "a", encoding="utf-8") as file:
            file.write(reply.line() + "\n")
            file.flush()
            os.fsync(file.fileno())
            self.found[reply.id] = reply


def read_replies(path: Path) -> dict[str, RecordedReply]:
    """Replies by row. Raises InputError where there is no such file."""
    if not path.is_file():
        raise InputError(f"There are no replies at '{path}'.")
    return _read(path)[1]


def replies_digest(replies: Mapping[str, RecordedReply]) -> str:
    """SHA-256 of all that was replied, whatever the order."""
    said = json.dumps([[i, replies[i].text] for i in sorted(replies)])
    return hashlib.sha256(said.encode()).hexdigest()


def _read(path: Path) -> tuple[bool, dict[str, RecordedReply]]:
    """Whether every line was one, and the replies; of two for a row the first counts."""
    if not path.exists():
        return True, {}
    lines = read_text(path, "replace").split("\n")
    found: dict[str, RecordedReply] = {}
    whole = lines[-1] == ""
    for line in filter(None, lines):
        reply = _parsed(line)
        if reply is None:
            whole = False
        else:
            found.setdefault(reply.id, reply)
    return whole, found


def _parsed(line: str) -> RecordedReply | None:
    try:
        data: Any = json.loads(line)
        row_id, text = data["id"], data["reply"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    if not isinstance(row_id, str) or not isinstance(text, str):
        return None
    counts = [data.get(name) for name in ("sent", "written")]
    sent, written = (n if type(n) is int and n >= 0 else None for n in counts)
    seconds = data.get("seconds")
    return RecordedReply(
        row_id,
        text,
        str(data.get("finish", "complete")),
        str(data.get("model_version", "")),
        sent,
        written,
        float(seconds) if isinstance(seconds, int | float) else 0.0,
    )
