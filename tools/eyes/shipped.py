"""From the ONNX files that torc ships back to networks that can be trained further.

An export melts each batch normalisation into the convolution before it. What its mean and spread were is measured again
on samples, so that the network does the same at first and has statistics to train with.
"""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

from tools.eyes.network import Descriptor, Eyes, Residual
from torc.perception.embedded.model import DESCRIPTOR, EYES


def shipped_eyes(samples: Tensor, path: Path = EYES) -> Eyes:
    """The shipped segmentation network; `samples` are some tens of inputs (n, CHANNELS, h, w)."""
    net = Eyes().eval()
    pairs = [
        pair
        for block in (*net.down, net.deep, *reversed(list(net.up)))
        if isinstance(block, Residual)
        for pair in ((block.first, block.norm_1), (block.second, block.norm_2))
    ]
    _take_over(net, pairs, path, samples)
    return net


def shipped_descriptor(samples: Tensor, path: Path = DESCRIPTOR) -> Descriptor:
    """The shipped descriptor; `samples` are some hundreds of inputs (n, 4, SIDE_PX, SIDE_PX)."""
    net = Descriptor().eval()
    pairs = [
        (layer, norm)
        for layer, norm in pairwise(net.layers)
        if isinstance(layer, nn.Conv2d) and isinstance(norm, nn.BatchNorm2d)
    ]
    _take_over(net, pairs, path, samples)
    return net


def _take_over(
    net: nn.Module, pairs: list[tuple[nn.Conv2d, nn.BatchNorm2d]], path: Path, samples: Tensor
) -> None:
    """Gives a network the weights of a file; `pairs` are the convolutions with what was melted into them, in order."""
    graph = onnx.load(str(path)).graph
    arrays = {
        a.name.removesuffix("_half"): torch.from_numpy(numpy_helper.to_array(a).astype(np.float32))
        for a in graph.initializer
    }
    state = net.state_dict()
    named = {name.removeprefix("net."): array for name, array in arrays.items()}
    state.update({name: array for name, array in named.items() if name in state})
    net.load_state_dict(state)
    melted = [
        (arrays[n.input[1]], arrays[n.input[2]])
        for n in graph.node
        if n.op_type == "Conv" and n.input[1].removeprefix("net.") not in state
    ]
    hooks = []
    for (conv, norm), (weight, bias) in zip(pairs, melted, strict=True):
        conv.weight.data.copy_(weight)
        hooks.append(norm.register_forward_pre_hook(_measure(bias)))
    with torch.no_grad():
        net(samples)
    for hook in hooks:
        hook.remove()


def _measure(bias: Tensor) -> Callable[[nn.Module, tuple[Tensor, ...]], None]:
    """Gives a normalisation the statistics of what it is about to see, and makes it add only the bias for now."""

    def hook(norm: nn.Module, inputs: tuple[Tensor, ...]) -> None:
        assert isinstance(norm, nn.BatchNorm2d)
        assert norm.running_mean is not None
        assert norm.running_var is not None
        mean, var = inputs[0].mean(dim=(0, 2, 3)), inputs[0].var(dim=(0, 2, 3), unbiased=False)
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(var)
        norm.weight.data.copy_((var + norm.eps).sqrt())
        norm.bias.data.copy_(bias + mean)

    return hook
