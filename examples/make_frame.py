"""Makes a frame for `torc decide`, as frame.npz is: what the simulated robot sees first in a shipped problem.

python examples/make_frame.py --out my_frame.npz
torc decide my_frame.npz
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from torc import load_problem, load_robot, load_workspace
from torc.sim.robot import SimulatedRobot
from torc.sim.simulated_world import build_world

DEPTH_SCALE_M = 0.0001
"""Metres per unit of the stored depth."""
DEFAULT_OUT = Path(tempfile.gettempdir()) / "torc_frame.npz"


def main(out: Path, problem_name: str = "validation-structured-02") -> None:
    """Looks once and writes the file. A camera of your own has to deliver the same arrays."""
    problem = load_problem(problem_name)
    workspace = load_workspace()
    with SimulatedRobot(build_world(problem, load_robot(), workspace)) as robot:
        robot.take_over()
        capture = robot.capture()
    seen, labels = capture.observation, capture.label_image
    assert labels is not None  # the simulator knows them
    np.savez_compressed(
        out,
        rgb=seen.rgb,
        depth=np.round(seen.depth_m / DEPTH_SCALE_M).astype(np.uint16),
        depth_scale=DEPTH_SCALE_M,
        K=seen.K,
        T_world_camera=seen.T_world_camera,
        labels=labels.astype(np.int16),  # -1 background, -2 the robot, else the number of the object
        target=0 if (labels == 0).any() else "hidden",
        target_description=problem.description,
        support_z_m=workspace.support_z_m,
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Makes a frame for `torc decide`.")
    parser.add_argument("--out", type=Path, default=DEFAULT_OUT, help="the file (default: %(default)s)")
    parser.add_argument("--problem", default="validation-structured-02", help="which problem is seen")
    asked = parser.parse_args()
    main(asked.out, asked.problem)
    print(f"torc decide {asked.out}")
