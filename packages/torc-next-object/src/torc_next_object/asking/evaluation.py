"""Ask a model about every row of a data set, and keep each reply as it comes."""

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from torc import InputError, TorcError, VlmConfig
from torc.io.reading import read_text
from torc.io.results import write_json
from torc.vlm.failures import FailureKind, VlmError
from torc.vlm.protocol import Question, VlmClient
from torc.vlm.replies import MAX_CHARACTERS, ask_client
from torc_next_object.prompting import prompt_digest, prompt_name, prompt_text, sent_pictures

FORMAT = "torc-next-object-evaluation/1"
REPLIES, FAILURES = "replies.jsonl", "failures.jsonl"
FACTS = "evaluation.json"
HOPELESS = frozenset({FailureKind.AUTH, FailureKind.NOT_FOUND, FailureKind.PROXY})
"""After these no further question is asked."""
MOST_IN_A_ROW = 8
"""After this many failures without a reply in between, the server is given up."""
Row = Mapping[str, Any]


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


_REPLY_FIELDS = RecordedReply.__dataclass_fields__.keys()
"""A later version may write more; those are ignored."""


class ReplyFile:
    """The replies of one run; `found` are all so far. Damaged lines, such as one that was cut off, are dropped."""

    def __init__(self, directory: Path) -> None:
        self.path = directory / REPLIES
        self.found: dict[str, RecordedReply] = {}
        text = read_text(self.path, "replace") if self.path.exists() else ""
        for line in filter(None, text.split("\n")):
            try:
                data = json.loads(line)
                reply = RecordedReply(**{k: data[k] for k in _REPLY_FIELDS & data.keys()})
            except (ValueError, TypeError, AttributeError, RecursionError):
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


@dataclass(frozen=True)
class Asked:
    """The result of asking.

    Attributes:
        replies: by row, those of earlier runs too.
        failures: why there is no reply this time, by row: such a row is neither right nor wrong.
        untried: number of rows that were not tried.
    """

    replies: Mapping[str, RecordedReply]
    failures: Mapping[str, str]
    untried: int


def question_of(row: Row, variant: str) -> Question:
    """Return a row as a question to a model, in free text."""
    return Question(prompt_text(row, variant), tuple(sent_pictures(row)))


def chosen_rows(rows: Sequence[Row], limit: int | None) -> list[Row]:
    """Return the first rows by id. Ids are hashes, so this is a sample, and a higher limit adds to it."""
    return sorted(rows, key=lambda row: str(row["id"]))[:limit]


def data_digest(rows: Sequence[Row], variant: str) -> str:
    """Return the SHA-256 of the questions about the rows and of the values of the choices, whatever the order."""
    whole = hashlib.sha256()
    for row in chosen_rows(rows, None):
        question = question_of(row, variant)
        pictures = [hashlib.sha256(png).hexdigest() for png in question.images]
        worth = [[*map(int, row["numbers"])], [*map(float, row["values"])], float(row["random_value"])]
        whole.update(json.dumps([row["id"], row["scene"], question.prompt, pictures, worth]).encode())
    return whole.hexdigest()


def begin(
    directory: Path, config: VlmConfig, variant: str, digest: str, version: int = 1
) -> tuple[ReplyFile, dict[str, Any]]:
    """Open or make a directory of replies; return it, and the facts of the evaluation, written to FACTS.

    Raises InputError if other questions were asked there, or another model.
    """
    facts: dict[str, Any] = {
        "format": FORMAT,
        "model": config.text,
        "temperature": config.temperature,
        "thinking": config.thinking,
        "max_output_tokens": config.max_output_tokens,
        "variant": variant,
        "prompt": prompt_name(variant, version),
        "prompt_sha256": prompt_digest(variant, version),
        "data_sha256": digest,
    }
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / FACTS
    if path.exists() or (directory / REPLIES).exists():
        try:
            before = dict(json.loads(read_text(path)))
        except (OSError, ValueError, TypeError):
            raise InputError(
                f"'{directory}' holds replies, and {FACTS} does not say to what. Choose another --out."
            ) from None
        if differ := [k for k in facts if before.get(k) != facts[k]]:
            raise InputError(
                f"'{directory}' holds replies to something else ({', '.join(differ)} differ). Choose another --out."
            )
    else:
        write_json(path, facts)
    return ReplyFile(directory), facts


def ask_rows(
    client: VlmClient,
    rows: Sequence[Row],
    variant: str,
    file: ReplyFile,
    workers: int,
    progress: Callable[[int, int], None],
) -> Asked:
    """Ask about every row that has no reply yet, several at a time.

    A reply is kept whatever it says. If the server gives none, that is a failure, written to FAILURES and tried again
    by the next run. `progress` is given the numbers of rows done and to do.
    """
    waiting = [row for row in rows if row["id"] not in file.found]
    failures: dict[str, str] = {}
    running: dict[Future[RecordedReply | TorcError], str] = {}
    untried, tried, in_a_row, hopeless = iter(waiting), 0, 0, False
    pool = ThreadPoolExecutor(workers)
    try:
        while True:
            for row in islice(untried, 0 if hopeless else workers - len(running)):
                running[pool.submit(_answer, client, row, variant)] = str(row["id"])
            if not running:
                break
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                row_id, found = running.pop(done), done.result()
                tried += 1
                if isinstance(found, RecordedReply):
                    file.add(found)
                    in_a_row = 0
                else:
                    failures[row_id] = str(found)
                    in_a_row += 1
                    doomed = isinstance(found, VlmError) and found.kind in HOPELESS
                    hopeless = hopeless or doomed or in_a_row >= MOST_IN_A_ROW
                progress(tried, len(waiting))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    lines = (json.dumps({"id": row_id, "why": why}) + "\n" for row_id, why in failures.items())
    (file.path.parent / FAILURES).write_text("".join(lines), encoding="utf-8")
    ids = {str(row["id"]) for row in rows}
    replies = {i: reply for i, reply in file.found.items() if i in ids}
    return Asked(replies, failures, len(waiting) - tried)


def _answer(client: VlmClient, row: Row, variant: str) -> RecordedReply | TorcError:
    try:
        reply = ask_client(client, question_of(row, variant))
    except TorcError as error:
        return error
    return RecordedReply(
        str(row["id"]),
        reply.text[-MAX_CHARACTERS:],
        reply.finish.value,
        reply.model_version,
        reply.tokens.prompt,
        reply.tokens.reply,
        round(reply.latency_s, 3),
    )
