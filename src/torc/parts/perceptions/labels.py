"""The masks that come with the picture; embedded reads a frame without them."""

from torc.perception.segmentation import LabelPerception as PART
