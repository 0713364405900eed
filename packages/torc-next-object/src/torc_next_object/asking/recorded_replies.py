"""Replies on disk, a line of JSON each, appended as they come: an interrupted run continues where it was."""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from torc.io.reading import read_text
from torc.vlm.protocol import Reply
from torc.vlm.replies import MAX_CHARACTERS

NAME = "replies.jsonl"


@dataclass(frozen=True)
class RecordedReply:
    """A model's reply about a row, as a line of the file has it.

    Attributes:
        id: of the row.
        reply: the end of the text, which is all that is ever read.
        finish: how it ended, a `torc.vlm.protocol.Finish`.
        model_version: as the server reports it.
        sent, written: tokens; None if the server does not report them. Thinking is part of what is written.
        seconds: until the reply was there.
    """

    id: str
    reply: str
    finish: str = "complete"
    model_version: str = ""
    sent: int | None = None
    written: int | None = None
    seconds: float = field(default=0.0, compare=False)


def recorded_reply(row_id: str, reply: Reply) -> RecordedReply:
    """Return a reply as it is kept."""
    return RecordedReply(
        row_id,
        reply.text[-MAX_CHARACTERS:],
        reply.finish.value,
        reply.model_version,
        reply.tokens.prompt,
        reply.tokens.reply,
        round(reply.latency_s, 3),
    )


class ReplyFile:
    """The replies of one run; `found` are all so far. Damaged lines, such as one that was cut off, are dropped."""

    def __init__(self, directory: Path) -> None:
        self.path = directory / NAME
        self.found: dict[str, RecordedReply] = {}
        text = read_text(self.path, "replace") if self.path.exists() else ""
        for line in filter(None, text.split("\n")):
            try:
                reply = RecordedReply(**json.loads(line))
            except (ValueError, TypeError, RecursionError):
                continue
            if isinstance(reply.id, str) and isinstance(reply.reply, str):
                self.found.setdefault(reply.id, reply)
        whole = "".join(_line(reply) for reply in self.found.values())
        if text != whole:
            temporary = self.path.with_name(self.path.name + ".tmp")
            temporary.write_text(whole, encoding="utf-8")
            os.replace(temporary, self.path)

    def add(self, reply: RecordedReply) -> None:
        """Append one; it is on the disk when this returns."""
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(_line(reply))
            file.flush()
            os.fsync(file.fileno())
        self.found[reply.id] = reply


def replies_digest(replies: Mapping[str, RecordedReply]) -> str:
    """Return the SHA-256 of all replies, whatever their order."""
    said = json.dumps([[i, replies[i].reply] for i in sorted(replies)])
    return hashlib.sha256(said.encode()).hexdigest()


def _line(reply: RecordedReply) -> str:
    return json.dumps(asdict(reply)) + "\n"
