"""Google Gemini (Gemini Robotics-ER is the paper's model), over google-genai."""

import logging
from typing import Any

from torc.vlm.clients.wire import NO_KEY, count, missing
from torc.vlm.config import VlmConfig
from torc.vlm.protocol import Finish, Question, Reply, Tokens
from torc.vlm.replies import reply_of

_API_VERSION = "v1beta"
"""Preview models, Robotics-ER among them, exist in no other."""
_REFUSALS = (
    *("SAFETY", "RECITATION", "LANGUAGE", "BLOCKLIST", "PROHIBITED_CONTENT", "SPII", "IMAGE_SAFETY"),
    *("IMAGE_PROHIBITED_CONTENT", "ESCALATION", "MODEL_ARMOR"),
)
_FINISHES = {
    **dict.fromkeys(("MAX_TOKENS", "CONTINUATION"), Finish.TRUNCATED),
    **dict.fromkeys(_REFUSALS, Finish.REFUSED),
}


class GeminiWire:
    """One client of google-genai. It is kept: the library closes a client that nobody holds."""

    def __init__(self, config: VlmConfig, key: str | None) -> None:
        try:
            from google import genai
            from google.genai import types
        except ImportError as error:
            raise missing("gemini") from error
        # Its warnings are about keys in the environment, which it is not let to choose from here.
        logging.getLogger("google_genai").setLevel(logging.ERROR)
        self._types, self._config = types, config
        options = types.HttpOptions(
            base_url=config.url,
            api_version=_API_VERSION,
            timeout=round(1000 * config.timeout_s),
            # A redirected request would carry the key's header to wherever it leads.
            client_args={"follow_redirects": False},
        )
        self._client = genai.Client(enterprise=False, api_key=key or NO_KEY, http_options=options)

    def send(self, question: Question) -> Reply:
        """One request."""
        parts: list[Any] = [
            self._types.Part.from_bytes(data=png, mime_type="image/png") for png in question.images
        ]
        response = self._client.models.generate_content(
            model=self._config.model, contents=[*parts, question.prompt], config=self._options(question)
        )
        return _read(response)

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


def _read(response: Any) -> Reply:
    """Blocked prompts, cut-off replies and empty ones all arrive as ordinary responses."""
    usage = response.usage_metadata
    tokens = Tokens(
        count(usage, "prompt_token_count"),
        count(usage, "candidates_token_count"),
        count(usage, "thoughts_token_count"),
    )
    version, feedback = response.model_version or "", response.prompt_feedback
    if not response.candidates:
        if feedback is None and usage is None:
            raise ValueError("no candidates, no usage")
        blocked = feedback is not None and feedback.block_reason is not None
        return reply_of("", version, Finish.REFUSED if blocked else Finish.EMPTY, tokens)
    candidate = response.candidates[0]
    parts = (candidate.content.parts if candidate.content else None) or []
    text = "".join(part.text for part in parts if part.text and not part.thought)
    reason = getattr(candidate.finish_reason, "value", candidate.finish_reason)
    return reply_of(text, version, _FINISHES.get(reason, Finish.COMPLETE), tokens)
