"""From a stereo pair, by a network behind a server."""

from torc_networks.depth import NetworkDepth as PART
