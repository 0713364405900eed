"""Asks a model about every row of a data set; what comes back is kept as it comes."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from threading import Event
from typing import Any

from torc import InputError, TorcError, VlmConfig
from torc.io.reading import read_text
from torc.io.results import write_json
from torc.vlm.failures import FailureKind, VlmError
from torc.vlm.protocol import Question, VlmClient
from torc.vlm.replies import ask_client
from torc_next_object.asking.recorded_replies import RecordedReply, ReplyFile, recorded_reply
from torc_next_object.prompting import prompt_digest, prompt_name, prompt_text, sent_pictures

FORMAT = "torc-next-object-evaluation/1"
FAILURES = "failures.jsonl"
FACTS = "evaluation.json"
HOPELESS = frozenset({FailureKind.AUTH, FailureKind.NOT_FOUND, FailureKind.PROXY})
"""After these no further question is asked."""
MOST_IN_A_ROW = 8
"""So many failures without a reply in between, and the server is given up."""
Row = Mapping[str, Any]
Told = Callable[[int, int], None]
"""Is told how many of how many are done."""


@dataclass(frozen=True)
class Failure:
    """A row about which there is no reply: neither right nor wrong."""

    id: str
    why: str


@dataclass(frozen=True)
class Asked:
    """All replies by row, those of earlier runs too, what failed this time, and how many were not tried at all."""

    replies: Mapping[str, RecordedReply]
    failures: tuple[Failure, ...]
    untried: int


def question_of(row: Row, variant: str) -> Question:
    """A row as a question to a model, in free text."""
    return Question(prompt_text(row, variant), tuple(sent_pictures(row)))


def chosen_rows(rows: Sequence[Row], limit: int | None) -> list[Row]:
    """The first rows by id: ids are hashes, so a limit takes a sample, and a higher one the same and more."""
    return sorted(rows, key=lambda row: str(row["id"]))[:limit]


def data_digest(rows: Sequence[Row], variant: str) -> str:
    """SHA-256 of what is asked about the rows and of what choices are worth, whatever the order."""
    whole = hashlib.sha256()
    for row in chosen_rows(rows, None):
        question = question_of(row, variant)
        pictures = [hashlib.sha256(png).hexdigest() for png in question.images]
        worth = [
            [int(n) for n in row["numbers"]],
            [float(v) for v in row["values"]],
            float(row["random_value"]),
        ]
        whole.update(json.dumps([row["id"], row["scene"], question.prompt, pictures, worth]).encode())
    return whole.hexdigest()


def begin(directory: Path, config: VlmConfig, variant: str, digest: str, version: int = 1) -> ReplyFile:
    """The replies in a directory, made if it is not there. Raises InputError where other questions were asked there, or
    another model.
    """
    facts = {
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
    if path.exists():
        try:
            before = json.loads(read_text(path))
        except ValueError:
            raise InputError(f"'{path}' is damaged. Choose another --out.") from None
        differ = [k for k in facts if not isinstance(before, dict) or before.get(k) != facts[k]]
        if differ:
            raise InputError(
                f"'{directory}' holds replies to something else ({', '.join(differ)} differ). Choose another --out."
            )
    elif (directory / "replies.jsonl").exists():
        raise InputError(
            f"'{directory}' holds replies, and nothing says to what ({FACTS} is missing). Choose another --out."
        )
    else:
        write_json(path, facts)
    return ReplyFile(directory)


def ask_rows(
    client: VlmClient, rows: Sequence[Row], variant: str, file: ReplyFile, workers: int, told: Told
) -> Asked:
    """Ask about every row that has no reply yet, several at a time. A reply is kept whatever it says; a server that
    gives none is a failure, written to FAILURES and tried again by the next run.
    """
    waiting = [row for row in rows if row["id"] not in file.found]
    failures: list[Failure] = []
    tried, in_a_row, hopeless = 0, 0, Event()
    for row_id, found in _answers(client, iter(waiting), variant, workers, hopeless.is_set):
        tried += 1
        if isinstance(found, RecordedReply):
            file.add(found)
            in_a_row = 0
        else:
            failures.append(Failure(row_id, str(found)))
            in_a_row += 1
            doomed = isinstance(found, VlmError) and found.kind in HOPELESS
            if doomed or in_a_row >= MOST_IN_A_ROW:
                hopeless.set()
        told(tried, len(waiting))
    lines = (json.dumps({"id": f.id, "why": f.why}) + "\n" for f in failures)
    (file.path.parent / FAILURES).write_text("".join(lines), encoding="utf-8")
    ids = {str(row["id"]) for row in rows}
    replies = {i: reply for i, reply in file.found.items() if i in ids}
    return Asked(replies, tuple(failures), len(waiting) - tried)


def _answers(
    client: VlmClient, waiting: Iterator[Row], variant: str, workers: int, stopped: Callable[[], bool]
) -> Iterator[tuple[str, RecordedReply | TorcError]]:
    """Replies and errors as they come; no more than `workers` questions are under way at a time."""
    running: dict[Future[RecordedReply | TorcError], str] = {}
    pool = ThreadPoolExecutor(workers)
    try:
        while True:
            for row in islice(waiting, 0 if stopped() else workers - len(running)):
                running[pool.submit(_answer, client, row, variant)] = str(row["id"])
            if not running:
                return
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(done), done.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _answer(client: VlmClient, row: Row, variant: str) -> RecordedReply | TorcError:
    try:
        return recorded_reply(str(row["id"]), ask_client(client, question_of(row, variant)))
    except TorcError as error:
        return error
