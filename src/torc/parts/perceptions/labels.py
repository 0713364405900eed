"""The masks that come with the picture; embedded reads a frame without them."""

from torc.perception.privileged import LabelPerception as PART
