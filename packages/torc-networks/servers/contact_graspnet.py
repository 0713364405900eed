"""Written against the documented interface; not yet run.

Grasps for `--grasps contact-graspnet` by Contact-GraspNet in PyTorch (elchun/contact_graspnet_pytorch).

Install: clone the repository (weights are in it), make its environment as its readme says, then in that environment
    pip install -e . && pip install --no-deps -e PATH_TO_TORC -e PATH_TO_TORC/packages/torc-networks
    pip install pyzmq msgpack jaxtyping
Run, in the clone:
    python PATH_TO_TORC/packages/torc-networks/servers/contact_graspnet.py
    torc run structured-03 --grasps contact-graspnet
Licence of code and weights: NVIDIA source code licence, not for commercial use.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from contact_graspnet_pytorch import config_utils
from contact_graspnet_pytorch.checkpoints import CheckpointIO
from contact_graspnet_pytorch.contact_grasp_estimator import GraspEstimator

from torc_networks.fields import request
from torc_networks.server import serve

_MARGIN_M, _WIDEST_M = 0.005, 0.08
"""The network opens the hand by this more than the object is wide, and never further than the Franka hand opens."""


def load(checkpoint: Path) -> GraspEstimator:
    """The network; without its weights it would answer at random."""
    estimator = GraspEstimator(config_utils.load_config(str(checkpoint), batch_size=1, arg_configs=[]))
    CheckpointIO(checkpoint_dir=str(checkpoint / "checkpoints"), model=estimator.model).load("model.pt")
    return estimator


def main() -> None:
    """Serve `grasps`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--checkpoint", type=Path, default=Path("checkpoints/contact_graspnet"))
    parser.add_argument("--passes", type=int, default=1, help="runs of the network for each request")
    parser.add_argument("--port", type=int, default=5557)
    options = parser.parse_args()
    estimator = load(options.checkpoint)

    @torch.inference_mode()
    def grasps(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        fields = request(asked)
        points = fields.finite("point_cloud", (None, 3)).astype(np.float32)
        ids = fields.array("object_ids", (len(points),), "i")
        seed = fields.whole("seed", 0, 2**31) if fields.has("seed") else 0
        np.random.seed(seed)
        torch.manual_seed(seed)
        segments = {k: points[ids == k] for k in np.unique(ids[ids >= 0]).tolist()}
        Ts, scores, _, openings = estimator.predict_scene_grasps(
            points,
            pc_segments=segments,
            local_regions=True,
            filter_grasps=True,
            forward_passes=options.passes,
        )
        found = [k for k in segments if len(Ts.get(k, ()))]
        if not found:
            return {
                "grasps": np.zeros((0, 4, 4)),
                "confidences": np.zeros(0),
                "object_ids": np.zeros(0, np.int64),
            }
        opening = np.concatenate([np.ravel(openings[k]) for k in found])
        widths = np.where(opening < _WIDEST_M - 1e-6, np.maximum(opening - _MARGIN_M, 0.0), np.nan)
        return {
            "grasps": np.concatenate([Ts[k] for k in found]),
            "confidences": np.clip(np.concatenate([np.ravel(scores[k]) for k in found]), 0, 1),
            "widths": widths,
            "object_ids": np.repeat(found, [len(Ts[k]) for k in found]),
        }

    serve({"grasps": grasps}, "Contact-GraspNet", options.port)


if __name__ == "__main__":
    main()
