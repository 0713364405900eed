"""From a stereo pair, by a network behind a server."""

from torc.perception.network.depth import NetworkDepth as PART
