"""Masks from a server."""

from torc.perception.network.perception import NetworkPerception as PART
