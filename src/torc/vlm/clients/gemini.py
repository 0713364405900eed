"""Google Gemini (Gemini Robotics-ER is the paper's model), over google-genai."""

import logging
from typing import Any

from torc.vlm.clients.wire import NO_KEY, WireReply, count, finished, missing, seconds_in
from torc.vlm.config import VlmConfig
from torc.vlm.failures import FailureKind, SendFailure, kind_of_status
from torc.vlm.protocol import Finish, Question, Tokens

_API_VERSION = "v1beta"
"""Preview models, Robotics-ER among them, exist in no other."""
_TRUNCATED = {"MAX_TOKENS", "CONTINUATION"}
_REFUSED = {
    "SAFETY",
    "RECITATION",
    "LANGUAGE",
    "BLOCKLIST",
    "PROHIBITED_CONTENT",
    "SPII",
    "IMAGE_SAFETY",
    "IMAGE_PROHIBITED_CONTENT",
    "ESCALATION",
    "MODEL_ARMOR",
}


class GeminiWire:
    """One client of google-genai. It is kept: the library closes a client that nobody holds."""

    def __init__(self, config: VlmConfig, key: str | None) -> None:
        try:
            from google import genai
            from google.genai import errors, types
        except ImportError as error:
            raise missing("gemini") from error
        # Its warnings are about keys in the environment, which it is not let to choose from here.
        logging.getLogger("google_genai").setLevel(logging.ERROR)
        self._types, self._errors, self._config = types, errors, config
        options = types.HttpOptions(
            base_url=config.url,
            api_version=_API_VERSION,
            timeout=round(1000 * config.timeout_s),
            # A redirected request would carry the key's header to wherever it leads.
            client_args={"follow_redirects": False},
        )
        self._client = genai.Client(enterprise=False, api_key=key or NO_KEY, http_options=options)

    def send(self, question: Question) -> WireReply:
        """One request. Raises SendFailure."""
        parts: list[Any] = [
            self._types.Part.from_bytes(data=png, mime_type="image/png") for png in question.images
        ]
        try:
            response = self._client.models.generate_content(
                model=self._config.model, contents=[*parts, question.prompt], config=self._options(question)
            )
            return _read(response)
        except self._errors.APIError as error:
            raise _failure(error) from None
        except Exception as error:  # the HTTP library's own errors, and whatever garbage makes of a parser
            raise _other_failure(error) from None

    def close(self) -> None:
        """Ends what is in flight."""
        self._client.close()

    def _options(self, question: Question) -> Any:
        c, types = self._config, self._types
        schema = question.schema if c.structured else None
        return types.GenerateContentConfig(
            temperature=c.temperature,
            max_output_tokens=c.max_output_tokens,
            seed=question.repeat if c.seeded else None,
            response_mime_type=None if schema is None else "application/json",
            response_json_schema=schema,
            thinking_config=self._thinking(),
            automatic_function_calling=types.AutomaticFunctionCallingConfig(disable=True),
        )

    def _thinking(self) -> Any:
        amount = self._config.thinking
        if amount is None:
            return None
        if isinstance(amount, int) or amount == "off":
            return self._types.ThinkingConfig(thinking_budget=amount if isinstance(amount, int) else 0)
        return self._types.ThinkingConfig(thinking_level=self._types.ThinkingLevel(amount.upper()))


def _read(response: Any) -> WireReply:
    """Blocked prompts, cut-off replies and empty ones all arrive as ordinary responses."""
    usage = response.usage_metadata
    tokens = Tokens(
        count(getattr(usage, "prompt_token_count", None)),
        count(getattr(usage, "candidates_token_count", None)),
        count(getattr(usage, "thoughts_token_count", None)),
    )
    feedback, candidates = response.prompt_feedback, response.candidates or []
    if not candidates and feedback is None and usage is None:
        raise SendFailure(FailureKind.BAD_RESPONSE, "no candidates, no usage")
    version = response.model_version or ""
    if not candidates:
        blocked = feedback is not None and feedback.block_reason is not None
        return WireReply("", Finish.REFUSED if blocked else Finish.EMPTY, version, tokens)
    parts = (candidates[0].content.parts if candidates[0].content else None) or []
    text = "".join(part.text for part in parts if part.text and not part.thought)
    reason = getattr(candidates[0].finish_reason, "value", candidates[0].finish_reason)
    finish = Finish.COMPLETE
    if reason in _TRUNCATED:
        finish = Finish.TRUNCATED
    elif reason in _REFUSED:
        finish = Finish.REFUSED
    return WireReply(text, finished(finish, text), version, tokens)


def _failure(error: Any) -> SendFailure:
    status = error.code if isinstance(error.code, int) else 0
    detail = f"HTTP {status} {error.status or ''} {error.message or ''}"
    if "API_KEY_INVALID" in str(error.details):  # arrives as an ordinary 400
        return SendFailure(FailureKind.AUTH, detail)
    return SendFailure(kind_of_status(status), detail, _retry_after_s(error))


def _retry_after_s(error: Any) -> float | None:
    """From the RetryInfo among the error's details."""
    details = error.details.get("error", {}) if isinstance(error.details, dict) else {}
    for item in (details.get("details") if isinstance(details, dict) else None) or []:
        if isinstance(item, dict) and str(item.get("@type", "")).endswith("RetryInfo"):
            return seconds_in(item.get("retryDelay"))
    return None


def _other_failure(error: Exception) -> SendFailure:
    if isinstance(error, SendFailure):
        return error
    name = type(error).__name__
    if "Timeout" in name:
        return SendFailure(FailureKind.TIMEOUT, name)
    if name.endswith(
        ("ConnectError", "ReadError", "WriteError", "ProtocolError", "NetworkError", "ProxyError")
    ):
        return SendFailure(FailureKind.CONNECTION, f"{name}: {error}")
    return SendFailure(FailureKind.BAD_RESPONSE, name)
