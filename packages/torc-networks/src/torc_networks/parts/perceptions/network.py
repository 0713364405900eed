"""Masks from a server."""

from torc_networks.perception import NetworkPerception as PART
