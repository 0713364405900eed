"""The two networks.

`Eyes` finds masks: a plain residual U-net on half the resolution of its input, whose outputs are at full resolution.
They say per pixel whether it shows an object; and for each of a list of offsets whether the pixel there shows the same
object (affinities). `Descriptor` says what an object looks like.
"""

from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from torc.perception.embedded.inputs import CHANNELS
from torc.perception.embedded.instances import OFFSETS

OUTPUTS = 1 + len(OFFSETS)
"""Object, affinities."""
WIDTHS = (32, 64, 96, 160, 192)
LENGTH = 64
"""Of a descriptor."""


class Residual(nn.Module):
    """Two convolutions and a way around them."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(inputs, outputs, 3, padding=1, bias=False)
        self.norm_1 = nn.BatchNorm2d(outputs)
        self.second = nn.Conv2d(outputs, outputs, 3, padding=1, bias=False)
        self.norm_2 = nn.BatchNorm2d(outputs)
        self.around = nn.Conv2d(inputs, outputs, 1, bias=False) if inputs != outputs else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        y = functional.relu(self.norm_1(self.first(x)))
        return functional.relu(self.norm_2(self.second(y)) + self.around(x))


class Eyes(nn.Module):
    """(n, CHANNELS, h, w) to (n, OUTPUTS, h, w) logits; h and w are multiples of 32."""

    def __init__(self, widths: tuple[int, ...] = WIDTHS) -> None:
        super().__init__()
        self.stem = nn.Conv2d(4 * CHANNELS, widths[0], 3, padding=1)
        self.down = nn.ModuleList(Residual(w, w) for w in widths)
        self.narrow = nn.ModuleList(nn.Conv2d(a, b, 2, stride=2) for a, b in pairwise(widths))
        self.wide = nn.ModuleList(nn.Conv2d(b, a, 1) for a, b in pairwise(widths))
        self.up = nn.ModuleList(Residual(w, w) for w in widths[:-1])
        self.deep = Residual(widths[-1], widths[-1])
        self.head = nn.Conv2d(widths[0], 4 * OUTPUTS, 1)

    def forward(self, x: Tensor) -> Tensor:
        x = self.stem(functional.pixel_unshuffle(x, 2))
        seen = []
        for block, narrow in zip(self.down, [*self.narrow, None], strict=True):
            x = block(x)
            if narrow is not None:
                seen.append(x)
                x = narrow(x)
        x = self.deep(x)
        for block, wide, side in zip(
            reversed(list(self.up)), reversed(list(self.wide)), reversed(seen), strict=True
        ):
            x = block(functional.interpolate(wide(x), scale_factor=2.0, mode="nearest") + side)
        out: Any = functional.pixel_shuffle(self.head(x), 2)
        return out


class Descriptor(nn.Module):
    """(n, 4, SIDE_PX, SIDE_PX) to (n, LENGTH), unit vectors."""

    def __init__(self, widths: tuple[int, ...] = (32, 64, 128, 160)) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        inputs = 4
        for width in widths:
            layers += [nn.Conv2d(inputs, width, 3, 2, 1, bias=False), nn.BatchNorm2d(width), nn.ReLU()]
            layers += [nn.Conv2d(width, width, 3, 1, 1, bias=False), nn.BatchNorm2d(width), nn.ReLU()]
            inputs = width
        self.layers = nn.Sequential(*layers)
        self.out = nn.Linear(2 * inputs, LENGTH)

    def forward(self, x: Tensor) -> Tensor:
        y = self.layers(x)
        pooled = torch.cat([y.mean(dim=(2, 3)), y.amax(dim=(2, 3))], dim=1)
        return functional.normalize(self.out(pooled), dim=1)
