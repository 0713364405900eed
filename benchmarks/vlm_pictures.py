"""What the marks in a VLM's picture do to the objects: how much of them still shows, and in which colour.

    python -m benchmarks.vlm_pictures --problems validation

looks at every problem once, before the first pick, and prints a row per way to show a scene. No model is asked.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import tyro

from torc.benchmark.spec import find_problems
from torc.episode.simulated import simulated_robot
from torc.pipeline.building import build_system
from torc.records import SegmentedScene
from torc.specs.conditions import Conditions
from torc.testing.contexts import see
from torc.vlm.picture_config import PictureConfig
from torc.vlm.pictures import pictures_of, shown_part

WAYS = (
    PictureConfig(),
    PictureConfig("outlines"),
    PictureConfig("tinted", crop_px=24, longest_side_px=1024),
    PictureConfig("outlines", crop_px=24, longest_side_px=1024),
)
CLEARLY_OTHER = 20.0
"""CIELAB difference from which a colour is clearly another one."""


@dataclass(frozen=True)
class Shown:
    """An object in a picture: pixels of the picture, share of them as without marks, and how far its mean colour moved
    (CIELAB), squares and all.
    """

    pixels: int
    untouched: float
    moved: float


def shown(scene: SegmentedScene, way: PictureConfig) -> list[Shown]:
    """Every visible object in a picture of the scene."""
    rgb, label = shown_part(scene, way)
    marked = np.asarray(
        cv2.imdecode(np.frombuffer(pictures_of(scene, way)[0].png, np.uint8), cv2.IMREAD_COLOR)
    )
    marked = marked[..., ::-1]
    before, after = (
        cv2.cvtColor(np.ascontiguousarray(image, dtype=np.float32) / 255, cv2.COLOR_RGB2LAB)
        for image in (rgb, marked)
    )
    same = np.all(marked == rgb, axis=2)
    return [
        Shown(
            int(np.count_nonzero(mask)),
            float(same[mask].mean()),
            float(np.linalg.norm(after[mask].mean(axis=0) - before[mask].mean(axis=0))),
        )
        for mask in (label == i for i in scene.ids)
    ]


def main(problems: str = "validation") -> None:
    """Print a row per way to show the scenes of these problems."""
    system = build_system(Conditions())
    scenes = []
    for problem in find_problems(problems).values():
        with simulated_robot(system, problem) as robot:
            robot.take_over()
            scenes.append(see(robot.capture()))
    print("| picture | objects | pixels, median | untouched, median | untouched, least | another colour |")
    print("|---|---|---|---|---|---|")
    for way in WAYS:
        found = [each for scene in scenes for each in shown(scene, way)]
        pixels, untouched = (np.array([getattr(o, k) for o in found]) for k in ("pixels", "untouched"))
        other = np.mean([o.moved > CLEARLY_OTHER for o in found])
        name = ", ".join((way.marks, *(w for w in way.words if w != way.marks)))
        print(
            f"| {name} | {len(found)} | {np.median(pixels):.0f} | {np.median(untouched):.2f} | {untouched.min():.2f} "
            f"| {other:.2f} |"
        )


if __name__ == "__main__":
    tyro.cli(main)
