"""Asks a server over a vendor's wire: deadline, retries, scrubbing; the same for all vendors."""

import time
from collections.abc import Callable

from torc.vlm.clients.wire import Wire, WireReply
from torc.vlm.config import VlmConfig
from torc.vlm.deadline import DeadlineError, within
from torc.vlm.failures import RETRYABLE, FailureKind, SendFailure, VlmError
from torc.vlm.keys import scrubbed
from torc.vlm.protocol import Question, Reply
from torc.vlm.replies import reply_of

MAX_WAIT_S = 60.0
"""A server that asks for a longer wait (a day's quota) is given up at once; own waits grow no longer."""
_MAX_DETAIL = 300


class ApiClient:
    """A VlmClient over the network.

    Args:
        config: model and manner.
        key: scrubbed from all that comes back.
        connect: opens a wire; each request has its own, so that no connection stays open or half read.
        sleep: waits between retries.
    """

    def __init__(
        self,
        config: VlmConfig,
        key: str | None,
        connect: Callable[[], Wire],
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.config = config
        self._key, self._connect, self._sleep = key, connect, sleep
        self._ready: Wire | None = connect()  # at once: a library that is missing shows now, not amid a trial

    def ask(self, question: Question) -> Reply:
        """The model's reply. Raises VlmError once the retries are used up, or at once if no retry can help."""
        for tries in range(1, self.config.retries + 2):
            outcome = self._send(question)
            if isinstance(outcome, Reply):
                return outcome
            failure = outcome
            wait_s = self._wait_s(failure, tries)
            if wait_s is None:
                break
            self._sleep(wait_s)
        raise VlmError(self.config.text, failure.kind, self._detail(failure), tries)

    def _send(self, question: Question) -> Reply | SendFailure:
        """A failure comes back as a value: an exception's context would show the vendor's own to whoever prints it."""
        wire, self._ready = self._ready or self._connect(), None
        started = time.perf_counter()
        try:
            reply = within(self.config.timeout_s, lambda: wire.send(question))
            return self._reply(reply, time.perf_counter() - started)
        except SendFailure as failure:
            return failure
        except DeadlineError:
            return SendFailure(FailureKind.TIMEOUT, f"no reply within {self.config.timeout_s:g} s")
        finally:
            wire.close()

    def _wait_s(self, failure: SendFailure, tries: int) -> float | None:
        """How long to wait before the next try; None if there is none."""
        if failure.kind not in RETRYABLE or tries > self.config.retries:
            return None
        if failure.retry_after_s is not None:
            return failure.retry_after_s if failure.retry_after_s <= MAX_WAIT_S else None
        return min(MAX_WAIT_S, self.config.retry_wait_s * 2.0 ** (tries - 1))

    def _detail(self, failure: SendFailure) -> str:
        detail = " ".join(scrubbed(failure.detail, self._key).split())
        if failure.retry_after_s is not None and failure.retry_after_s > MAX_WAIT_S:
            detail = f"it asks to wait {failure.retry_after_s:g} s; {detail}"
        return detail[:_MAX_DETAIL]

    def _reply(self, reply: WireReply, latency_s: float) -> Reply:
        text = scrubbed(reply.text, self._key)
        version = scrubbed(reply.model_version, self._key)[:_MAX_DETAIL]
        return reply_of(text, version, reply.finish, reply.tokens, latency_s)
