"""The choice of a model, and how it is asked."""

import difflib
import math
import re
from dataclasses import dataclass, field
from importlib.util import find_spec
from urllib.parse import urlsplit

from torc.errors import InputError
from torc.io.numbers import take_numbers
from torc.registry.kinds import CLIENTS
from torc.registry.loading import part_paths, short_part_name, unknown_part
from torc.vlm.picture_config import PictureConfig
from torc.vlm.prices import Prices
from torc.vlm.prompt import Prompt

PROVIDERS = {
    "gemini": "https://generativelanguage.googleapis.com",
    "openai": "https://api.openai.com/v1",
    "anthropic": "https://api.anthropic.com",
}
"""Vendor -> address of its own service."""
SIMULATED = "simulated"
"""The provider of the simulated VLM, which answers from the simulator's truth and takes no part in comparisons."""
DEFAULT_PROFILE = "paper"
"""The profile that `--vlm simulated` alone means."""
LEVELS = ("off", "minimal", "low", "medium", "high")
"""Named amounts of thinking."""
QUESTIONS = (2, 3)
DEFAULT_QUESTIONS = 2
"""The version that the published results used."""
_MAX_NAME = 200
_NEAR = 0.82


@dataclass(frozen=True)
class Asking:
    """How a planner asks.

    Attributes:
        picture: how scenes are drawn.
        prompt: a prompt in place of the planner's own.
        structured: True if the server holds the reply to a JSON schema, so that the prompt need not ask for JSON.
        questions: version of the questions.
    """

    picture: PictureConfig = field(default_factory=PictureConfig)
    prompt: Prompt | None = None
    structured: bool = True
    questions: int = DEFAULT_QUESTIONS


@dataclass(frozen=True)
class VlmConfig:
    """A model and how it is asked. It holds no key: keys come only from the environment.

    None leaves a choice to the model.

    Attributes:
        provider: "gemini", "openai" (OpenAI and every server that speaks its protocol), "anthropic", "simulated", or a
            registered or "module:Class" client.
        model: the model's name there; the profile of the simulated VLM; empty if a user-defined client needs none.
        base_url: address of the server; None for the provider's.
        temperature: sampling temperature.
        thinking: "off", "minimal", "low", "medium", "high", or a number of tokens. Not every model knows every value;
            its server says so.
        max_output_tokens: bound on a reply, thinking included (Anthropic's default here: 16384).
        seeded: send the number of the repetition as the sampling seed (not to Anthropic, which has none).
        structured: have the server hold the reply to the answer's JSON schema; otherwise the prompt asks for JSON.
        timeout_s: for one reply, seconds.
        retries: further requests after one without a reply.
        retry_wait_s: wait before the first retry, seconds, doubled for each further one; a server's own request for a
            wait takes precedence.
        picture: how scenes are drawn.
        prompt: a prompt in place of the planner's.
        prices: prices of the model's tokens; None if unknown.
        questions: version of prompts and pictures (docs/vlm.md).
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
    picture: PictureConfig = field(default_factory=PictureConfig)
    prompt: Prompt | None = None
    prices: Prices | None = None
    questions: int = DEFAULT_QUESTIONS

    def __post_init__(self) -> None:
        take_numbers(self)
        if self.third_party and ":" not in self.provider:
            known = part_paths(CLIENTS)
            if self.provider not in known:
                raise unknown_part(CLIENTS, self.provider, known)
        named = self.model.isprintable() and " " not in self.model and len(self.model) <= _MAX_NAME
        if not named or not (self.model or self.third_party):
            raise InputError(
                f"'{self.model[:_MAX_NAME]}' is no model name: write gemini:MODEL or openai:MODEL@URL."
            )
        if self.base_url is not None:
            _check_url(self.base_url)
        _check_thinking(self.provider, self.thinking)
        if self.questions not in QUESTIONS:
            versions = ", ".join(map(str, QUESTIONS))
            raise InputError(f"There are no questions of version {self.questions}; there are {versions}.")
        bounds = {
            "temperature": (self.temperature, 0, 2),
            "max_output_tokens": (self.max_output_tokens, 1, math.inf),
            "time-out": (self.timeout_s, 1e-3, 1e9),
            "number of retries": (self.retries, 0, 100),
            "wait before a retry": (self.retry_wait_s, 0, 3600),
        }
        for what, (value, low, high) in bounds.items():
            if value is not None and not low <= value <= high:
                raise InputError(f"The VLM's {what} is {value}; it must be {low:g} to {high:g}.")

    @property
    def simulated(self) -> bool:
        """True if the simulator's truth is asked instead of a model."""
        return self.provider == SIMULATED

    @property
    def third_party(self) -> bool:
        """True if the client is neither a vendor's nor the simulated one; it may need no model name."""
        return self.provider not in (*PROVIDERS, SIMULATED)

    @property
    def url(self) -> str:
        """Address of the server; empty for a client that knows its own."""
        return self.base_url or PROVIDERS.get(self.provider, "")

    @property
    def text(self) -> str:
        """The model as written on the command line."""
        model = f":{self.model}" if self.model else ""
        return f"{self.provider}{model}" + (f"@{self.base_url}" if self.base_url else "")

    @property
    def asking(self) -> "Asking":
        """The part of the configuration that planners need."""
        third = self.questions >= 3 and self.picture == PictureConfig()
        picture = PictureConfig(marks="clear") if third else self.picture
        return Asking(picture, self.prompt, self.structured, self.questions)

    @property
    def words(self) -> tuple[str, ...]:
        """How pictures and prompts differ from torc's own, for labels."""
        version = () if self.questions == DEFAULT_QUESTIONS else (f"questions {self.questions}",)
        return (*version, *self.picture.words, *(() if self.prompt is None else (self.prompt.words,)))

    @property
    def short_name(self) -> str:
        """Name for directories: the model, preceded by the provider unless that is a vendor."""
        if self.provider in PROVIDERS:
            return self.model
        return "-".join(part for part in (short_part_name(self.provider), self.model) if part)


def parse_vlm(text: str) -> tuple[str, str, str | None]:
    """Split "provider:MODEL" or "provider:MODEL@URL" into provider, model and base URL.

    Any other provider is read as "module:Class". Raises InputError, also for a vendor's model with an "@" that no URL
    follows.
    """
    # Model names may hold "@" (a version), so the URL starts after an "@" before a scheme.
    name, *address = re.split(r"@(?=https?://)", text, maxsplit=1)
    base_url = address[0] if address else None
    provider, colon, model = name.partition(":")
    if provider in PROVIDERS and base_url is None and "@" in model:
        # Maybe an address without its scheme: pictures meant for a private server would go to the vendor.
        before, _, after = name.partition("@")
        raise InputError(
            f"'{name}': what follows an @ must be the address of a server, with http:// or https://. "
            f"Write {before}@http://{after or 'localhost:8000/v1'}, or leave out the @."
        )
    if name == SIMULATED:
        return SIMULATED, DEFAULT_PROFILE, base_url
    known = part_paths(CLIENTS)
    if provider in known and (model or (provider not in PROVIDERS and provider != SIMULATED and not colon)):
        return provider, model, base_url
    if provider not in known and provider and model:
        near = "." not in provider and difflib.get_close_matches(provider, known, cutoff=_NEAR)
        if near and find_spec(provider) is None:
            raise unknown_part(CLIENTS, provider, known)
        class_name, _, model = model.partition(":")
        return f"{provider}:{class_name}", model, base_url
    raise InputError(
        f"'{name}' names no VLM. Write gemini:MODEL, anthropic:MODEL, openai:MODEL, or, for a server of your own, "
        "openai:MODEL@URL, e.g. openai:qwen2.5-vl@http://localhost:8000/v1; simulated, or simulated:PROFILE, in "
        "simulated trials; module:Class or path/to/file.py:Class for a client of your own."
    )


def parse_thinking(text: str | None) -> str | int | None:
    """Return a number for digits ("512" -> 512), any other text unchanged."""
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
        # Not repeated in the message: the surplus may be a key.
        raise InputError(
            f"The VLM's address at {parts.hostname} must hold no user, password, query or fragment: addresses are "
            "written to logs. A key for it goes into the environment, as TORC_VLM_API_KEY."
        )


def _check_thinking(provider: str, thinking: str | int | None) -> None:
    if thinking is None or thinking in LEVELS:
        return
    if isinstance(thinking, str | bool) or thinking < 0:
        raise InputError(f"Thinking is '{thinking}'; it must be {', '.join(LEVELS)}, or a number of tokens.")
    if provider == "openai":
        raise InputError(
            "OpenAI-compatible servers take thinking in words (off, low, medium, high), not in tokens."
        )
