"""Check what every perception must do: `check_perception(MyPerception)`. How well it finds objects is not judged."""

from collections.abc import Callable

import numpy as np

from torc.perception.checked_scenes import scene_faults
from torc.perception.protocol import Perception, Wanted
from torc.records import SegmentedScene
from torc.registry.kinds import PERCEPTIONS
from torc.testing.conformance import called_twice, require, trait_faults
from torc.testing.contexts import box
from torc.testing.synthetic import Shape, synthetic_capture

_CASES: dict[str, tuple[Shape, ...]] = {
    "a single box": (box(1, 0.62, -0.10, (0.05, 0.06, 0.10)),),
    "one behind another": (box(0, 0.72, -0.1, (0.06, 0.06, 0.2)), box(1, 0.60, -0.1, (0.06, 0.08, 0.12))),
    "one on another": (box(0, 0.65, -0.1, (0.12, 0.12, 0.06)), box(1, 0.65, -0.1, (0.05, 0.05, 0.06), 0.06)),
    "nothing in sight": (),
}


def check_perception(make: Callable[[], Perception]) -> None:
    """Run all cases with fresh perceptions. Raises NonConformanceError with everything that was broken."""
    broken = [f"{name}: {text}" for name, shapes in _CASES.items() for text in _violations(make, shapes)]
    require("perception", broken)


def _violations(make: Callable[[], Perception], shapes: tuple[Shape, ...]) -> list[str]:
    """Return the rules that a perception breaks in an episode of two looks, the second without the first object."""
    perception = make()
    if faults := trait_faults(PERCEPTIONS, perception):
        return faults
    first, found = _look(perception, shapes, None)
    if first is None or found:
        return found
    second, found = _look(perception, shapes[1:], first)
    return found if second is None else found + _id_faults(second, first)


def _look(
    perception: Perception, shapes: tuple[Shape, ...], before: SegmentedScene | None
) -> tuple[SegmentedScene | None, list[str]]:
    """Return the scene, None if it is unusable, and the rules that were broken."""
    capture = synthetic_capture(shapes)
    observation, given = capture.observation, {}
    if PERCEPTIONS.traits(perception).needs_labels:
        given["label_image"] = capture.label_image
    scenes, found = called_twice(
        lambda: perception.perceive(observation, Wanted("the blue tuna can"), before, **given),
        observation,
        "the observation",
    )
    faults = [fault for scene in scenes for fault in scene_faults(scene, observation)]
    if faults or not scenes:
        return None, found + faults
    if not _alike(*scenes):
        found.append("the same snapshot gave two different scenes")
    return scenes[0], found


def _alike(a: SegmentedScene, b: SegmentedScene) -> bool:
    same_points = all(np.array_equal(p.points, q.points) for p, q in zip(a.objects, b.objects))
    return a.ids == b.ids and same_points and np.array_equal(a.label_image, b.label_image)


def _id_faults(scene: SegmentedScene, before: SegmentedScene) -> list[str]:
    """Return the objects that did not move but have another id now."""
    there = {o.id: o.points.mean(axis=0) for o in before.objects}
    faults = []
    for o in scene.objects:
        middle = o.points.mean(axis=0)
        was = min(there, key=lambda k: float(((there[k] - middle) ** 2).sum()), default=None)
        alike = was is not None and ((there[was] - middle) ** 2).sum() < 0.005**2
        if alike and was != o.id:
            faults.append(f"object {was} stayed where it was, and is called {o.id} in the next snapshot")
    return faults
