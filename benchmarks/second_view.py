"""What the right camera of a stereo pair adds to the occlusion volume (`torc.occlusion.volume`).

    python -m benchmarks.second_view

The first look at each problem, with the depth of `--depth sgbm` and the simulator's masks: the space that is unseen and
hidden by nothing, where the arm may never go; all that is unseen; and the share of the space within objects that is
wrongly taken for free.
"""

from dataclasses import dataclass, replace

import numpy as np
import tyro

from torc.episode.simulated import simulated_robot
from torc.occlusion.volume import FIXED_REAL_CAMERA, empty_volume, update_volume
from torc.perception.segmentation import REAL_CAMERA
from torc.perception.stereo import SgbmDepth
from torc.pipeline.building import build_system
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import EMPTY
from torc.sim.visibility import filled_voxels
from torc.specs.conditions import Conditions
from torc.testing.contexts import see

_LITRE = 1e3


@dataclass(frozen=True)
class Args:
    """Compare volumes from one camera of a pair with those from both."""

    problems: str = "torc40"
    """A set, problems or a directory of them, with commas between."""


def measured(name: str) -> np.ndarray:
    """Litres: unseen and hidden by nothing, unseen, seen free though filled, filled; without the right camera, and
    with it.
    """
    system = build_system(Conditions(depth="sgbm"))
    with simulated_robot(system, load_problem(name)) as robot:
        robot.take_over()
        capture, filled = robot.capture(), filled_voxels(robot.world)
        grid = robot.world.workspace.grid
    observation = SgbmDepth().measure(capture.observation)
    scene = see(replace(capture, observation=observation), REAL_CAMERA)
    rows = []
    for pair in (None, observation.pair):
        view = replace(scene, observation=replace(scene.observation, pair=pair))
        volume = update_volume(empty_volume(grid), view, FIXED_REAL_CAMERA)
        unseen, free = ~volume.seen, volume.seen & (volume.surface_label == EMPTY)
        rows.append([unseen & (volume.hidden_by == 0), unseen, free & filled, filled])
    return np.array([[np.count_nonzero(v) for v in row] for row in rows]) * grid.voxel_size_m**3 * _LITRE


def main(args: Args) -> None:
    """Prints a table."""
    volumes = np.array([measured(p) for p in select_problems(args.problems)])
    print("| seen by | unseen, hidden by nothing, litres a problem | unseen | of objects, taken for free |")
    print("|---|---|---|---|")
    for name, (fixed, unseen, wrong, filled) in zip(("left camera", "both"), volumes.mean(axis=0)):
        print(f"| {name} | {fixed:.1f} | {unseen:.1f} | {wrong / filled:.2%} |")


if __name__ == "__main__":
    main(tyro.cli(Args))
