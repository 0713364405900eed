"""Replies on disk: recorded once, replayed without a key or a network.

A cache is a directory with one JSON file per question: the question, with digests of its images, and the reply. Server
errors are never recorded. Refused, cut-off and useless replies are, because they are part of the measurement.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from torc.errors import InputError
from torc.io.reading import read_text
from torc.io.record_files import to_plain
from torc.io.results import write_json
from torc.records.evidence import Tokens
from torc.vlm.config import VlmConfig
from torc.vlm.protocol import Finish, Question, Reply, VlmClient
from torc.vlm.replies import ask_client, reply_faults, reply_of

FORMAT = "torc-vlm-cache/2"
_MAX_FILE_BYTES = 4_000_000


class CacheMode(StrEnum):
    """What happens to replies: RECORD keeps and reuses them, REPLAY only reuses those kept, OFF does neither."""

    RECORD = "record"
    REPLAY = "replay"
    OFF = "off"


@dataclass(frozen=True)
class CacheConfig:
    """Where replies are kept, and how they are used."""

    directory: Path
    mode: CacheMode = CacheMode.RECORD


class CachedClient:
    """A VlmClient that asks another client only for what its cache does not hold.

    Without another client it only replays, and raises InputError if the directory does not exist. Everything in the
    config that can change a reply is part of the key.
    """

    def __init__(self, config: VlmConfig, directory: Path, client: VlmClient | None = None) -> None:
        self.config, self.directory, self._client = config, directory, client
        if client is None and not directory.is_dir():
            raise InputError(f"There is no VLM cache at '{directory}' to replay from.")

    def ask(self, question: Question) -> Reply:
        """Return the recorded reply, or ask for a new one and record it.

        Raises:
            VlmError: the other client raised it.
            InputError: the reply is missing and there is no other client, a file is damaged, or the directory cannot be
                written.
        """
        request = request_facts(self.config, question)
        key = cache_key(request)
        path = self.directory / key[:2] / f"{key}.json"
        if path.exists():
            return _read(path, request)
        if self._client is None:
            raise InputError(
                f"The VLM cache '{self.directory}' holds no reply to this question ({path.name}): it was recorded with "
                "something else. Use record mode to ask the model."
            )
        reply = ask_client(self._client, question)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # Without the answer, which is parsed from the text again.
            facts = to_plain(replace(reply, answer=None, latency_s=round(reply.latency_s, 4)))
            del facts["answer"]
            write_json(path, {"format": FORMAT, "request": request, "reply": facts})
        except OSError as error:
            raise InputError(
                f"Cannot write to the VLM cache '{self.directory}': {error.strerror}."
            ) from error
        return reply


def request_facts(config: VlmConfig, question: Question) -> dict[str, Any]:
    """Return everything that can change a reply, as plain data; time-outs and retries cannot.

    Facts that older questions did not have are left out while they are empty, so that old replies are still found.
    """
    facts = {
        "provider": config.provider,
        "url": config.url,
        "model": config.model,
        "temperature": None if config.temperature is None else float(config.temperature),
        "thinking": config.thinking,
        "max_output_tokens": config.max_output_tokens,
        "seeded": config.seeded,
        "schema": dict(question.schema) if config.structured and question.schema is not None else None,
        "prompt": question.prompt,
        "images": [hashlib.sha256(png).hexdigest() for png in question.images],
        "repeat": question.repeat,
    }
    facts |= {"system": question.system} if question.system else {}
    return facts | ({"examples": [asdict(e) for e in question.examples]} if question.examples else {})


def cache_key(request: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a request's facts. The order of a schema's entries counts: models write in that order."""
    facts = {k: request[k] for k in sorted(request)}
    return hashlib.sha256(json.dumps(facts, ensure_ascii=True).encode()).hexdigest()


def _read(path: Path, request: Mapping[str, Any]) -> Reply:
    """Read a recorded reply. Caches may come from strangers, so everything in the file is checked."""
    try:
        if path.stat().st_size > _MAX_FILE_BYTES:
            raise ValueError("it is too large")
        data = json.loads(read_text(path))
        if data["format"] != FORMAT or data["request"] != json.loads(json.dumps(request)):
            raise ValueError("it answers another question")
        facts = data["reply"]
        finish, tokens = Finish(facts["finish"]), Tokens(**facts["tokens"])
        reply = reply_of(facts["text"], facts["model_version"], finish, tokens, facts["latency_s"])
        for fault in reply_faults(reply):
            raise ValueError(fault)
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(
            f"'{path}' in the VLM cache is damaged ({type(error).__name__}: {error}). Delete it or get it anew."
        ) from error
    return reply
