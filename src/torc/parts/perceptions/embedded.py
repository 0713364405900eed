"""torc's own eyes: small networks on the CPU."""

from torc.perception.embedded.perception import EmbeddedPerception as PART
