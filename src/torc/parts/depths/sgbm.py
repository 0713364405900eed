"""From a stereo pair, by semi-global block matching."""

from torc.perception.stereo import SgbmDepth as PART
