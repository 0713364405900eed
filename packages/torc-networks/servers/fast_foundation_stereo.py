"""Written against the documented interface; not yet run.

Disparities for `--depth network` by Fast-FoundationStereo (NVlabs/Fast-FoundationStereo).

Install: clone the repository, make its environment as its readme says, fetch its weights, then in that environment
    pip install --no-deps -e PATH_TO_TORC -e PATH_TO_TORC/packages/torc-networks
    pip install pyzmq msgpack jaxtyping
Run, in the clone:
    python PATH_TO_TORC/packages/torc-networks/servers/fast_foundation_stereo.py --weights weights/MODEL.pth
    torc run structured-03 --depth network
Licence of code and weights: NVIDIA source code licence, not for commercial use; C-Fast-FoundationStereo, for commercial
use, is given out through TAO and not loaded here. The weights are a pickled module, that is, a program: load only one
from NVIDIA, and never in the robot's own process.
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
_MOST_PX = 192
"""The checkpoints look for no larger disparity: use --depth.scale where near things need more."""


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
    parser.add_argument("--weights", type=Path, required=True)
    parser.add_argument("--iterations", type=int, default=8)
    parser.add_argument("--port", type=int, default=5555)
    options = parser.parse_args()
    sys.path.insert(0, ".")  # the pickled module's classes are in the clone
    model = torch.load(options.weights, map_location="cuda", weights_only=False).eval()

    @torch.inference_mode()
    def stereo(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        fields = request(asked)
        left = fields.bytes("left", (None, None))
        right = fields.bytes("right", left.shape)
        most = fields.whole("max_disparity", 1, 10_000)
        if most > _MOST_PX:
            print(f"Disparities up to {most} px are wanted; {_MOST_PX} px is the most. Lower --depth.scale.")
        with torch.autocast("cuda"):
            found = model(as_input(left), as_input(right), iters=options.iterations, test_mode=True)
        return {
            "disparity": found.float()
            .cpu()
            .numpy()
            .reshape(found.shape[-2:])[: left.shape[0], : left.shape[1]]
        }

    serve({"stereo": stereo}, "Fast-FoundationStereo", options.port)


if __name__ == "__main__":
    main()
