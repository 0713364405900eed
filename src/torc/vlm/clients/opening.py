"""From a configuration to a client. A vendor's library is imported when its client is opened, not before."""

from collections.abc import Callable, Mapping
from importlib import import_module
from types import MappingProxyType

from torc.vlm.clients.api import ApiClient
from torc.vlm.clients.wire import Wire
from torc.vlm.config import VlmConfig
from torc.vlm.keys import find_key

_WIRES: Mapping[str, str] = MappingProxyType(
    {
        "gemini": "torc.vlm.clients.gemini:GeminiWire",
        "openai": "torc.vlm.clients.openai_compatible:OpenAiWire",
        "anthropic": "torc.vlm.clients.claude:AnthropicWire",
    }
)
"""Provider -> "module:Class"."""


def open_api_client(config: VlmConfig) -> ApiClient:
    """A client of the model's server; nothing is sent yet.

    Raises InputError without a key, and MissingDependencyError without the vendor's library.
    """
    key = find_key(config)
    module, _, name = _WIRES[config.provider].partition(":")
    wire: Callable[[VlmConfig, str | None], Wire] = getattr(import_module(module), name)
    return ApiClient(config, key, lambda: wire(config, key))
