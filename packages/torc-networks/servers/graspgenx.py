"""Written against the documented interface; not yet run.

Grasps for `--grasps graspgenx` by GraspGenX (NVlabs/GraspGenX), for the gripper that torc describes in each request.

Install, in an environment of its own with an NVIDIA GPU, from a clone as its readme says (uv sync); or the inference
part alone, which others package (eden-graspgenx 0.1.0, after which this file was written):
    pip install eden-graspgenx
    pip install --no-deps -e PATH_TO_TORC -e PATH_TO_TORC/packages/torc-networks
    pip install pyzmq msgpack jaxtyping
Run:
    python packages/torc-networks/servers/graspgenx.py
    torc run structured-03 --grasps graspgenx
NVIDIA's own server in the clone's client-server/ speaks the same words, but knows only the gripper it was started with:
give its fingertip (--grasps.fingertip_m). So does that of GraspGen (licence: research and evaluation), at port 5556 as
well; it listens on all interfaces.
Licences: code Apache-2.0, weights (adithyamurali/GraspGenXModel, fetched at the first start) NVIDIA Open Model Licence.
"""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch
from graspgenx import get_checkpoints_version_dir
from graspgenx.grasp_server import GraspGenXSampler
from graspgenx.samplers.planner import run_planner_on_object
from graspgenx.utils.checkpoint_io import load_model_cfg
from graspgenx.x_grippers import XGripperInfo, get_gripper_info

from torc.io.digests import fingerprint
from torc_networks.fields import request
from torc_networks.server import serve


class Grippers:
    """The grippers that were described so far, as GraspGenX reads them: a folder with a config.json each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def of(self, config: Mapping[str, Any]) -> XGripperInfo:
        """What the network is conditioned on."""
        name = fingerprint(config)[:16]
        (self.folder / name).mkdir(exist_ok=True)
        (self.folder / name / "config.json").write_text(json.dumps(config))
        return get_gripper_info(str(self.folder), name)


def main() -> None:
    """Serve `infer`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--gripper", default="robotiq_2f_85", help="where a request describes none")
    parser.add_argument("--planner", choices=("graspmoe", "diffusion"), default="graspmoe")
    parser.add_argument("--port", type=int, default=5556)
    options = parser.parse_args()
    weights = get_checkpoints_version_dir()
    sampler = GraspGenXSampler(load_model_cfg(str(weights / "gen"), str(weights / "dis")), options.gripper)
    own = sampler.gripper
    with TemporaryDirectory() as folder:
        grippers = Grippers(Path(folder))

        def infer(asked: Mapping[str, Any]) -> Mapping[str, Any]:
            fields = request(asked)
            points = fields.finite("point_cloud", (None, 3)).astype(np.float32)
            seed = fields.whole("seed", 0, 2**31) if fields.has("seed") else 0
            torch.manual_seed(seed)
            np.random.seed(seed)
            sampler.gripper = grippers.of(asked["gripper"]) if fields.has("gripper") else own
            grasps, confidences, _, _ = run_planner_on_object(
                points,
                sampler,
                planner=options.planner,
                grasp_threshold=float(asked.get("grasp_threshold", -1.0)),
                num_grasps=int(asked.get("num_grasps", 200)),
                topk_num_grasps=int(asked.get("topk_num_grasps", 100)),
            )
            return {"grasps": grasps, "confidences": np.clip(confidences, 0, 1), "num_grasps": len(grasps)}

        serve({"infer": infer}, "GraspGenX", options.port)


if __name__ == "__main__":
    main()
