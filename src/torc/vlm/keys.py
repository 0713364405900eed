"""Keys: from the environment only, sent to nobody but the server they are for, scrubbed from all that comes back."""

import os
import re

from torc.errors import InputError
from torc.vlm.config import VlmConfig

OWN_SERVER_VARIABLE = "TORC_VLM_API_KEY"
"""The key for a server at an address that the user gave. A vendor's key never goes to such a one."""
VARIABLES = {
    "gemini": ("GOOGLE_API_KEY", "GEMINI_API_KEY"),
    "openai": ("OPENAI_API_KEY",),
    "anthropic": ("ANTHROPIC_API_KEY",),
}
"""Provider -> environment variables, the first that is set counts."""
_ENCODED = re.compile(r"[A-Za-z0-9+/_=-]{120,}")
_MAX_TEXT = 200_000


def find_key(config: VlmConfig) -> str | None:
    """The key for a model's server; None for a server of one's own that needs none.

    Raises InputError if a vendor's key is not in the environment, or cannot be one.
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
    """Text from a server without the key, without long encoded data (an echoed image), and not endless."""
    text = text[:_MAX_TEXT].encode("utf-8", "replace").decode()
    if key:
        text = text.replace(key, "[key]")
    return _ENCODED.sub("[data]", text)
