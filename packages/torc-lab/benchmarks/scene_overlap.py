"""The overlap of `torc lab scene`, where nothing moved and where an object was moved by so much.

    python packages/torc-lab/benchmarks/scene_overlap.py [--problems validation]

Pictures of the simulated camera with the noise of a stereo camera, grain, and light that differs by up to 10 %; masks
are the true ones. Every object in sight is moved in a random direction, by every distance.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import tyro

from torc.perception.noise import add_sensor_noise, stereo_camera
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import BACKGROUND, Capture, Observation
from torc.robots.loading import load_robot
from torc.sim.robot import SimulatedCamera
from torc.sim.simulated_world import World, build_world
from torc.workspace.workspace_files import load_workspace
from torc_lab.scenes.laying_out import THRESHOLD
from torc_lab.scenes.overlap import measure_overlap
from torc_lab.scenes.scene import PICTURES, median_picture

_LEAST_PX = 60


@dataclass(frozen=True)
class Args:
    """Measure on problems."""

    problems: str = "validation"
    """Sets or names, comma-separated."""
    distances_mm: tuple[int, ...] = (3, 5, 10, 20, 30)
    """How far objects are moved."""
    seed: int = 0
    """Of noise and directions."""


def noisy(clean: Observation, rng: np.random.Generator) -> Observation:
    """As a stereo camera sees it, in slightly other light."""
    light, grain = rng.uniform(0.9, 1.1), rng.normal(0, 4, clean.rgb.shape)
    rgb = np.clip(clean.rgb * light + grain, 0, 255).astype(np.uint8)
    return replace(add_sensor_noise(Capture(clean), stereo_camera(), rng).observation, rgb=rgb)


def measured(
    world: World, camera: SimulatedCamera, distances_mm: tuple[int, ...], rng: np.random.Generator
) -> Iterator[tuple[int, float]]:
    """How far an object was moved, millimetres, and its overlap then."""
    capture, grid = camera.capture(), world.workspace.grid
    clean, label = capture.observation, capture.label_image
    assert label is not None
    ids = [k for k in np.unique(label[label >= 0]).tolist() if np.count_nonzero(label == k) >= _LEAST_PX]
    kept = np.where(np.isin(label, ids), label, BACKGROUND).astype(np.int16)
    reference = Capture(median_picture([noisy(clean, rng) for _ in range(PICTURES)]), kept)
    yield from ((0, v) for v in measure_overlap(reference, noisy(clean, rng), grid).objects.values())
    places, turns = world.positions.copy(), world.wxyz.copy()
    for k in ids:
        for distance_mm in distances_mm:
            angle = rng.uniform(0, 2 * np.pi)
            by_m = distance_mm * 1e-3 * np.array([np.cos(angle), np.sin(angle), 0])
            world.set_object_pose(k, places[k] + by_m, turns[k])
            world.update_position_stage()
            yield (
                distance_mm,
                measure_overlap(reference, noisy(camera.capture().observation, rng), grid).objects[k],
            )
        world.set_object_pose(k, places[k], turns[k])


def main(args: Args) -> None:
    """Prints a row per distance."""
    robot, workspace, rng = load_robot(), load_workspace(), np.random.default_rng(args.seed)
    found: dict[int, list[float]] = {}
    for name in select_problems(args.problems):
        world = build_world(load_problem(name), robot, workspace)
        with SimulatedCamera(world) as camera:
            for distance_mm, overlap in measured(world, camera, args.distances_mm, rng):
                found.setdefault(distance_mm, []).append(overlap)
    print("| moved by | objects | least | 5 % below | median | 95 % below | accepted |")
    print("|---" * 7 + "|")
    for distance_mm, values in sorted(found.items()):
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
        accepted = np.mean(np.array(values) >= THRESHOLD)
        print(
            f"| {distance_mm} mm | {len(values)} | {min(values):.2f} | {low:.2f} | {middle:.2f} | {high:.2f} | "
            f"{accepted:.0%} |"
        )


if __name__ == "__main__":
    main(tyro.cli(Args))
