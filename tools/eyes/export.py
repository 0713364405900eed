"""From trained weights to the ONNX files that torc ships: probabilities as outputs, weights at half precision."""

from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import helper, numpy_helper
from torch import Tensor, nn

from tools.eyes.network import Descriptor, Eyes
from torc.perception.embedded.inputs import CHANNELS
from torc.perception.embedded.model import SIDE_PX

_OPSET = 17
_SMALL = 256
"""Arrays with fewer numbers keep their precision."""


class _Probabilities(nn.Module):
    def __init__(self, net: nn.Module) -> None:
        super().__init__()
        self.net = net

    def forward(self, x: Tensor) -> Tensor:
        return torch.sigmoid(self.net(x))


def load_eyes(checkpoint: Path) -> Eyes:
    """The network with the averaged weights of a training."""
    state = torch.load(checkpoint, weights_only=True, map_location="cpu")["average"]
    net = Eyes()
    net.load_state_dict({k.removeprefix("module."): v for k, v in state.items() if k.startswith("module.")})
    return net.eval()


def export_eyes(checkpoint: Path, out: Path) -> None:
    """Writes the segmentation network."""
    example = torch.zeros(1, CHANNELS, 96, 128)
    axes = {"inputs": {2: "height", 3: "width"}, "outputs": {2: "height", 3: "width"}}
    _export(_Probabilities(load_eyes(checkpoint)).eval(), example, out, axes)


def export_descriptor(weights: Path, out: Path) -> None:
    """Writes the descriptor."""
    net = Descriptor()
    net.load_state_dict(torch.load(weights, weights_only=True)["net"])
    example = torch.zeros(2, 4, SIDE_PX, SIDE_PX)
    _export(net.eval(), example, out, {"inputs": {0: "objects"}, "outputs": {0: "objects"}})


def _export(net: nn.Module, example: Tensor, out: Path, axes: dict[str, dict[int, str]]) -> None:
    torch.onnx.export(
        net,
        (example,),
        str(out),
        input_names=["inputs"],
        output_names=["outputs"],
        dynamic_axes=axes,
        opset_version=_OPSET,
        dynamo=False,
    )
    model = onnx.load(str(out))
    halve(model.graph)
    onnx.checker.check_model(model)
    onnx.save(model, str(out))


def halve(graph: onnx.GraphProto) -> None:
    """Stores large arrays at half precision, in place; they are computed with at full precision."""
    casts = []
    for array in graph.initializer:
        values = numpy_helper.to_array(array)
        if values.dtype == np.float32 and values.size >= _SMALL:
            name = array.name
            array.CopyFrom(numpy_helper.from_array(values.astype(np.float16), f"{name}_half"))
            casts.append(helper.make_node("Cast", [f"{name}_half"], [name], to=onnx.TensorProto.FLOAT))
    for node in reversed(casts):
        graph.node.insert(0, node)
