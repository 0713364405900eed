"""Writes SAM 2.1 as two ONNX files for `--perception sam2-onnx`: python -m tools.sam2_onnx --out DIR

Needs the extra `sam` and `pip install onnx`; what reads the files needs neither. The picture's size is the weights'
own (1024 px); the number of boxes is free. Weights of facebook/sam2.1-hiera-* are under Apache-2.0, and so is what is
made of them.
"""

import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
import tyro
from torch import Tensor, nn

from torc.errors import InputError, TorcError
from torc.perception.embedded.model import onnx_session
from torc.perception.sam.network import SAM2, Runtime, load_network
from torc.perception.sam.onnx_files import BOXES, DECODER, ENCODER, EXPECTED, MAPS, MASKS, PICTURE
from torc.perception.sam.weights import known_weights

_OPSET = 17
_TOLERANCE = 1e-3


class Encoder(nn.Module):
    """A picture's maps."""

    def __init__(self, model: Any) -> None:
        super().__init__()
        self.model = model

    def forward(self, pixel_values: Tensor) -> tuple[Tensor, ...]:
        """Pixel values (1, 3, s, s) to three maps."""
        return tuple(self.model.get_image_embeddings(pixel_values))


class Decoder(nn.Module):
    """A mask for each box."""

    def __init__(self, model: Any) -> None:
        super().__init__()
        self.model = model

    def forward(self, first: Tensor, second: Tensor, third: Tensor, boxes: Tensor) -> tuple[Tensor, Tensor]:
        """Three maps and boxes (1, n, 4) in the network's pixels to mask logits (1, n, 1, h, w) and expected overlaps
        (1, n, 1).
        """
        out = self.model(image_embeddings=[first, second, third], input_boxes=boxes, multimask_output=False)
        return out.pred_masks, out.iou_scores


@dataclass(frozen=True)
class Export:
    """Write SAM 2.1 as two ONNX files."""

    out: Path
    """Folder of the two files."""
    weights: str = "facebook/sam2.1-hiera-tiny"
    """A folder, or an id on the Hugging Face hub."""


def export_sam2(weights: str, out: Path) -> None:
    """Writes both files, and checks that they say what torch says. Raises InputError if they do not, and as
    `load_network`.
    """
    model = load_network(SAM2, weights, Runtime()).model
    # A module is born for training, and the exporter leaves all within it as it was.
    encoder, decoder = Encoder(model).eval(), Decoder(model).eval()
    side = model.config.prompt_encoder_config.image_size
    out.mkdir(parents=True, exist_ok=True)
    generator = torch.Generator().manual_seed(0)
    picture = torch.randn(1, 3, side, side, generator=generator)
    boxes = torch.tensor([[[0.1, 0.1, 0.5, 0.6], [0.3, 0.2, 0.9, 0.7], [0.5, 0.5, 0.8, 0.9]]]) * side
    with torch.no_grad():
        maps = encoder(picture)
        _write(encoder, (picture,), out / ENCODER, ([PICTURE], list(MAPS)), weights)
        names = [*MAPS, BOXES], [MASKS, EXPECTED]
        _write(decoder, (*maps, boxes), out / DECODER, names, weights)
        _check(encoder, (picture,), out / ENCODER)
        _check(decoder, (*maps, boxes[:, :2]), out / DECODER)


def _write(
    net: nn.Module, given: tuple[Tensor, ...], path: Path, names: tuple[list[str], list[str]], weights: str
) -> None:
    free = {name: {1: "boxes"} for name in (BOXES, MASKS, EXPECTED) if name in (*names[0], *names[1])}
    with warnings.catch_warnings():
        # Sizes that are fixed in the network become constants, of which the tracer warns; the exporter that needs no
        # onnxscript is on its way out.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            net,
            given,
            str(path),
            input_names=names[0],
            output_names=names[1],
            dynamic_axes=free,
            opset_version=_OPSET,
            dynamo=False,
        )
    model = onnx.load(str(path))
    known = known_weights(weights)
    if known is not None:
        onnx.helper.set_model_props(model, {"weights": known.name, "licence": known.licence})
    onnx.checker.check_model(model)
    onnx.save(model, str(path))


def _check(net: nn.Module, given: tuple[Tensor, ...], path: Path) -> None:
    session = onnx_session(path, 1)
    named = {i.name: t.numpy() for i, t in zip(session.get_inputs(), given, strict=True)}
    for found, wanted in zip(session.run(None, named), net(*given), strict=True):
        error, most = float(np.abs(found - wanted.numpy()).max()), float(wanted.abs().max())
        if not error <= _TOLERANCE * most:
            raise InputError(f"{path} says something else than torch: {error:.2g} off, of {most:.2g}.")


def main(arguments: Sequence[str] | None = None) -> int:
    """0 when done, 1 on failure, 2 on bad input."""
    given = tyro.cli(Export, args=arguments, prog="python -m tools.sam2_onnx")
    try:
        export_sam2(given.weights, given.out)
    except TorcError as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    print(f"{given.out / ENCODER}\n{given.out / DECODER}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
