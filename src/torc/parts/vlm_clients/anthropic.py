"""Anthropic's models: anthropic:MODEL."""

from torc.vlm.clients.api import open_api_client as PART
