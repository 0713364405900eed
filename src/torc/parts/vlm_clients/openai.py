"""OpenAI's models, and servers that speak its protocol: openai:MODEL@URL."""

from torc.vlm.clients.api import open_api_client as PART
