"""Readings within objects' true masks that show what lies elsewhere, as stereo matching leaves them: with and without
`PerceptionConfig.piece_px`.

    python -m benchmarks.stray_depth

The first look at each problem, with the depth of `--depth sgbm` and the simulator's masks, against exact depth. Per
object of at least 300 pixels: the share of the readings that are used and more than 2 cm off, and how far its cloud
ends behind (in front of, if negative) where what is in sight of it ends, along the horizontal line of sight.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import tyro

from torc.episode.simulated import simulated_robot
from torc.perception.segmentation import REAL_CAMERA, PerceptionConfig
from torc.perception.stereo import SgbmDepth
from torc.pipeline.building import build_system
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import Capture
from torc.specs.conditions import Conditions
from torc.testing.contexts import see

_FAR_M, _LEAST_PX = 0.02, 300


@dataclass(frozen=True)
class Args:
    """Compare clouds of stereo depth with exact ones."""

    problems: str = "validation"
    """A set, problems or a directory of them, with commas between."""


def first_look(name: str) -> Capture:
    """With exact depth, and the pair."""
    system = build_system(Conditions(depth="sgbm"))
    with simulated_robot(system, load_problem(name)) as robot:
        robot.take_over()
        return robot.capture()


def measured(capture: Capture, config: PerceptionConfig) -> Iterator[tuple[float, float]]:
    """Per object: share of readings far off, and how far the cloud ends behind the exact one, metres."""
    exact, truth = capture.observation, see(capture)
    seen = see(replace(capture, observation=SgbmDepth().measure(exact)), config)
    for o in seen.objects:
        if o.pixel_count < _LEAST_PX:
            continue
        rows, cols = o.pixels.T
        off = np.abs(seen.observation.depth_m[rows, cols] - exact.depth_m[rows, cols]) > _FAR_M
        points = truth.object(o.id).points
        view = points.mean(axis=0) - exact.T_world_camera[:3, 3]
        view = view[:2] / np.linalg.norm(view[:2])
        yield float(off.mean()), float((o.points[:, :2] @ view).max() - (points[:, :2] @ view).max())


def main(args: Args) -> None:
    """Prints a table."""
    looks = [first_look(p) for p in select_problems(args.problems)]
    print(
        "| piece_px | objects | readings more than 2 cm off | clouds end too far behind, mm: median | 90 % |"
    )
    print("|---|---|---|---|---|")
    for piece_px in (0, REAL_CAMERA.piece_px):
        config = replace(REAL_CAMERA, piece_px=piece_px)
        off, behind = np.array([m for look in looks for m in measured(look, config)]).T
        middle, high = 1e3 * np.median(behind), 1e3 * np.quantile(behind, 0.9)
        print(f"| {piece_px} | {len(off)} | {off.mean():.3f} | {middle:.0f} | {high:.0f} |")


if __name__ == "__main__":
    main(tyro.cli(Args))
