"""Keys: read only from the environment, sent only to their server, scrubbed from everything that comes back."""

import os
import re

from torc.errors import InputError
from torc.vlm.config import VlmConfig

OWN_SERVER_VARIABLE = "TORC_VLM_API_KEY"
"""The key for a server at a user's address. A vendor's key is never sent there."""
VARIABLES = {
    "gemini": ("GOOGLE_API_KEY", "GEMINI_API_KEY"),
    "openai": ("OPENAI_API_KEY",),
    "anthropic": ("ANTHROPIC_API_KEY",),
}
"""Environment variables by provider; the first that is set counts."""
_ENCODED = re.compile(r"[A-Za-z0-9+/_=-]{120,}")
_MAX_TEXT = 200_000


def find_key(config: VlmConfig) -> str | None:
    """Return the key for a model's server; None for a user's server that needs none.

    Raises:
        InputError: a vendor's key is missing from the environment, or cannot be a key.
    """
    names = VARIABLES[config.provider] if config.base_url is None else (OWN_SERVER_VARIABLE,)
    name = next((n for n in names if os.environ.get(n, "").strip()), None)
    if name is None:
        if config.base_url is not None:
            return None
        raise InputError(
            f"No key for {config.provider} in the environment. Set it with: export {names[-1]}=... "
            "(keys are never read from files or arguments)."
        )
    key = os.environ[name].strip()
    if not key.isascii() or not key.isprintable() or " " in key:
        raise InputError(f"The key in {name} holds characters that no key has. Copy it again.")
    return key


def scrubbed(text: str, key: str | None) -> str:
    """Return a server's text without the key and without long encoded data (an echoed image), and bounded in length."""
    text = text[:_MAX_TEXT].encode("utf-8", "replace").decode()
    if key:
        text = text.replace(key, "[key]")
    return _ENCODED.sub("[data]", text)
