"""Written against the documented interface; not yet run.

Disparities for `--depth network` by FoundationStereo (NVlabs/FoundationStereo).

Install: clone the repository, make its environment as its readme says, fetch a checkpoint, then in that environment
    pip install --no-deps -e PATH_TO_TORC -e PATH_TO_TORC/packages/torc-networks
    pip install pyzmq msgpack jaxtyping
Run, in the clone:
    python PATH_TO_TORC/packages/torc-networks/servers/foundation_stereo.py \\
        --checkpoint pretrained_models/23-51-11/model_best_bp2.pth
    torc run structured-03 --depth network
Licence of code and weights: NVIDIA source code licence, not for commercial use. NVIDIA gives out variants for
commercial use through TAO (C-FoundationStereo), which this file does not load. The checkpoint is a pickle: load only
one from NVIDIA.
"""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch.nn import functional

from torc_networks.fields import request
from torc_networks.server import serve

_MULTIPLE_PX = 32


def load(checkpoint: Path) -> torch.nn.Module:
    """The model of a checkpoint, which has its settings beside it in cfg.yaml."""
    sys.path.insert(0, ".")
    from core.foundation_stereo import FoundationStereo
    from omegaconf import OmegaConf

    settings = OmegaConf.load(checkpoint.parent / "cfg.yaml")
    if "vit_size" not in settings:
        settings["vit_size"] = "vitl"
    model = FoundationStereo(settings)
    model.load_state_dict(torch.load(checkpoint, map_location="cpu", weights_only=False)["model"])
    return model.cuda().eval()


def as_input(picture: np.ndarray) -> torch.Tensor:
    """(1, 3, H, W), 0 to 255, filled up at the right and at the bottom to multiples of 32."""
    rgb = torch.from_numpy(picture).float().cuda()[None, None].expand(1, 3, -1, -1)
    height, width = picture.shape
    return functional.pad(rgb, (0, -width % _MULTIPLE_PX, 0, -height % _MULTIPLE_PX), mode="replicate")


def main() -> None:
    """Serve `stereo`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--checkpoint", type=Path, required=True)
    parser.add_argument("--iterations", type=int, default=32)
    parser.add_argument("--port", type=int, default=5555)
    options = parser.parse_args()
    model = load(options.checkpoint)

    @torch.inference_mode()
    def stereo(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        fields = request(asked)
        left = fields.bytes("left", (None, None))
        right = fields.bytes("right", left.shape)
        with torch.autocast("cuda"):
            found = model(as_input(left), as_input(right), iters=options.iterations, test_mode=True)
        return {
            "disparity": found.float()
            .cpu()
            .numpy()
            .reshape(found.shape[-2:])[: left.shape[0], : left.shape[1]]
        }

    serve({"stereo": stereo}, "FoundationStereo", options.port)


if __name__ == "__main__":
    main()
