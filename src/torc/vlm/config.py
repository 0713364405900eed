"""Which model is asked, and how."""

import math
from dataclasses import dataclass
from urllib.parse import urlsplit

from torc.errors import InputError, UnknownNameError

PROVIDERS = {
    "gemini": "https://generativelanguage.googleapis.com",
    "openai": "https://api.openai.com/v1",
    "anthropic": "https://api.anthropic.com",
}
"""Provider -> address of its own service."""
LEVELS = ("off", "minimal", "low", "medium", "high")
"""Amounts of thinking in words."""
_MAX_NAME = 200


@dataclass(frozen=True)
class VlmConfig:
    """A model and how it is asked. Holds no key: keys come from the environment alone (`torc.vlm.keys`).

    Attributes:
        provider: "gemini", "openai" (OpenAI and every server that speaks its protocol) or "anthropic".
        model: the model's name at that provider.
        base_url: address of the server; None for the provider's own.
        temperature: None for the model's own.
        thinking: "off", "minimal", "low", "medium", "high" or a whole number of tokens; None for the model's own.
            Not every model knows every value; its server says so.
        max_output_tokens: bound on a reply, thinking included; None for the model's own (Anthropic: 16384).
        seeded: send the number of the repetition as the sampling seed (not to Anthropic, which has none).
        structured: have the server hold the model to the answer's JSON schema; else the prompt alone asks for JSON.
        timeout_s: a request is given up after this time.
        retries: further requests after one that brought no reply.
        retry_wait_s: wait before the first retry, doubled for each further one; what the server asks for comes first.
    """

    provider: str
    model: str
    base_url: str | None = None
    temperature: float | None = None
    thinking: str | int | None = None
    max_output_tokens: int | None = None
    seeded: bool = False
    structured: bool = True
    timeout_s: float = 120.0
    retries: int = 4
    retry_wait_s: float = 1.0

    def __post_init__(self) -> None:
        if self.provider not in PROVIDERS:
            raise UnknownNameError("VLM provider", self.provider, list(PROVIDERS))
        if not self.model or len(self.model) > _MAX_NAME or not self.model.isprintable() or " " in self.model:
            raise InputError(
                f"'{self.model[:_MAX_NAME]}' is no model name: write gemini:MODEL or openai:MODEL@URL."
            )
        if self.base_url is not None:
            _check_url(self.base_url)
        _check_thinking(self.provider, self.thinking)
        if self.temperature is not None and not 0 <= self.temperature <= 2:
            raise InputError(f"The temperature is {self.temperature}; it must be 0 to 2.")
        if self.max_output_tokens is not None and self.max_output_tokens < 1:
            raise InputError(f"max_output_tokens is {self.max_output_tokens}; it must be at least 1.")
        if not (math.isfinite(self.timeout_s) and self.timeout_s > 0):
            raise InputError(f"The VLM's time-out is {self.timeout_s} s; it must be above 0.")
        if not 0 <= self.retries <= 100 or not 0 <= self.retry_wait_s <= 3600:
            raise InputError("VLM retries must be 0 to 100, and the wait before one 0 to 3600 s.")

    @property
    def url(self) -> str:
        """Address of the server."""
        return self.base_url or PROVIDERS[self.provider]

    @property
    def text(self) -> str:
        """As it is written on the command line."""
        return f"{self.provider}:{self.model}" + (f"@{self.base_url}" if self.base_url else "")


def parse_vlm(text: str) -> tuple[str, str, str | None]:
    """Provider, model and base URL of "provider:MODEL" or "provider:MODEL@URL". Raises InputError."""
    provider, colon, rest = text.partition(":")
    if not colon or not rest:
        raise InputError(
            f"'{text}' names no VLM. Write gemini:MODEL, anthropic:MODEL, openai:MODEL, or, for a server of your "
            "own, openai:MODEL@URL, e.g. openai:qwen2.5-vl@http://localhost:8000/v1."
        )
    # Model names may hold "@" (a version), so the URL is what follows the last one before a scheme.
    for scheme in ("@http://", "@https://"):
        model, at, address = rest.partition(scheme)
        if at:
            return provider, model, scheme[1:] + address
    return provider, rest, None


def parse_thinking(text: str | None) -> str | int | None:
    """ "512" -> 512, anything else as it is."""
    return int(text) if text is not None and text.isascii() and text.isdigit() else text


def _check_url(url: str) -> None:
    try:
        parts = urlsplit(url)
        _ = parts.port
    except ValueError as error:
        raise InputError(f"'{url}' is no address of a server: {error}.") from error
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise InputError(f"'{url}' is no address of a server; write e.g. http://localhost:8000/v1.")
    if parts.username or parts.password or parts.query or parts.fragment:
        # Not repeated in the message: what is too much may be a key.
        raise InputError(
            f"The VLM's address at {parts.hostname} must hold no user, password, query or fragment: addresses are "
            "written to logs. A key for it goes into the environment, as TORC_VLM_API_KEY."
        )


def _check_thinking(provider: str, thinking: str | int | None) -> None:
    if thinking is None or (isinstance(thinking, str) and thinking in LEVELS):
        return
    if isinstance(thinking, str | bool):
        raise InputError(f"Thinking is '{thinking}'; it must be {', '.join(LEVELS)}, or a number of tokens.")
    if thinking < 0:
        raise InputError(f"Thinking is {thinking} tokens; it must be at least 0.")
    if provider == "openai":
        raise InputError(
            "OpenAI-compatible servers take thinking in words (off, low, medium, high), not in tokens."
        )
