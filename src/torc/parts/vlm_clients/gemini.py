"""Google's models: gemini:MODEL."""

from torc.vlm.clients.api import open_api_client

PART = open_api_client
