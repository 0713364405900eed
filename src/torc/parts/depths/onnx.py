"""From a stereo pair, by a network in a file."""

from torc.perception.onnx_stereo import OnnxDepth as PART
