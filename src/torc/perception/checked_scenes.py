"""Ask any perception, camera or depth, and check that its result can be used."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from jaxtyping import Bool

from torc.errors import PartError
from torc.perception.protocol import Depth, Perception, Wanted
from torc.records import (
    BACKGROUND,
    MAX_OBJECTS,
    ROBOT,
    TARGET_ID,
    Capture,
    Observation,
    SegmentedScene,
    as_capture,
)
from torc.registry.kinds import PERCEPTIONS
from torc.registry.loading import blamed, kind_of_value
from torc.robots.protocols import Camera, Robot

_HELP = "torc.testing.perception_conformance checks a perception against all rules (docs/extending.md)."
_UNIT_TOLERANCE = 1e-3


def ask_perception(
    perception: Perception, capture: Capture, wanted: Wanted, before: SegmentedScene | None
) -> SegmentedScene:
    """Return the scene that a perception makes of a snapshot; it receives the label image only if it needs labels.

    Raises PartError if it crashed or did not return a scene of this snapshot; its own TorcError passes unchanged.
    """
    what = f"Perception {type(perception).__name__}"
    needs_labels = PERCEPTIONS.traits(perception).needs_labels
    given: dict[str, Any] = {"label_image": capture.label_image} if needs_labels else {}
    with blamed(what, PartError, _HELP):
        scene: Any = perception.perceive(capture.observation, wanted, before, **given)
    for fault in scene_faults(scene, capture.observation):
        raise PartError(f"{what} gave no valid scene: {fault}. {_HELP}")
    return scene


def ask_camera(camera: Camera | Robot) -> Capture:
    """Return a snapshot from a camera, or from a robot that has one. Raises PartError as `ask_perception`."""
    with _judged("Camera", camera) as refuse:
        seen: Any = camera.capture()
        capture = as_capture(seen)
        refuse(observation_faults(capture.observation, "capture()"))
        if capture.label_image is not None and capture.label_image.shape != capture.observation.depth_m.shape:
            refuse(["its label image has another size than depth_m"])
    return capture


def ask_depth(depth: Depth, observation: Observation) -> Observation:
    """Return the snapshot with the depth to use. Raises PartError as `ask_perception`."""
    with _judged("Depth", depth) as refuse:
        measured = depth.measure(observation)
        refuse(observation_faults(measured, "measure()"))
    return measured


@contextmanager
def _judged(kind: str, part: object) -> Iterator[Callable[[Iterable[str]], None]]:
    """Blame a part for errors in the block, and for the faults that the block passes on."""
    what = f"{kind} {type(part).__name__}"
    remedy = f"torc.testing.{kind.lower()}_conformance checks a {kind.lower()} against all rules (docs/extending.md)."

    def refuse(faults: Iterable[str]) -> None:
        for fault in faults:
            raise PartError(f"{what} gave no valid observation: {fault}. {remedy}")

    with blamed(what, PartError, remedy):
        yield refuse


def observation_faults(observation: Any, method: str) -> Iterator[str]:
    """Yield the reasons why something is not a valid RGB-D snapshot; `method` returned it."""
    if not isinstance(observation, Observation):
        yield f"{method} returned {kind_of_value(observation)}, not a torc.records.Observation"
        return
    depth = observation.depth_m
    if not isinstance(depth, np.ndarray) or depth.ndim != 2 or depth.dtype != np.float32:
        yield "depth_m must be a float32 array of shape (height, width), in metres"
    elif observation.rgb.shape != (*depth.shape, 3) or observation.rgb.dtype != np.uint8:
        yield f"rgb must be a uint8 array of shape {(*depth.shape, 3)}, as large as depth_m"


def ask_recognition(
    perception: Perception,
    observation: Observation,
    mask: Bool[np.ndarray, "h w"],
    wanted: Wanted,
    scene: SegmentedScene,
    object_id: int,
) -> float | None:
    """Return the probability that the object in the hand is the target, as a perception gives it; None if it cannot
    say.

    Args:
        perception: one with a method `recognise`.
        observation: snapshot after the lift.
        mask: pixels of the held object.
        wanted: the target.
        scene: the latest scene.
        object_id: the held object's id in it.

    Raises:
        PartError: as in `ask_perception`, or the result is not a probability.
    """
    what = f"Perception {type(perception).__name__}"
    recognise: Any = perception.recognise  # type: ignore[attr-defined]
    with blamed(what, PartError, _HELP):
        p = recognise(observation, mask, wanted, scene, object_id)
    if p is not None and not 0 <= p <= 1:
        raise PartError(f"{what}: recognise returned {p!r}, which is no probability. {_HELP}")
    return None if p is None else float(p)


def scene_faults(scene: Any, observation: Observation) -> Iterator[str]:
    """Yield the reasons why something is not a valid scene of a snapshot; later ones may depend on earlier ones."""
    if not isinstance(scene, SegmentedScene):
        yield f"perceive() returned {kind_of_value(scene)}, not a torc.records.SegmentedScene"
        return
    label, shape = scene.label_image, observation.depth_m.shape
    if not isinstance(label, np.ndarray) or label.shape != shape or label.dtype != np.int16:
        yield f"label_image must be an int16 array of shape {shape}"
        return
    if label.min() < min(BACKGROUND, ROBOT) or label.max() >= MAX_OBJECTS:
        yield f"label_image holds labels outside of {min(BACKGROUND, ROBOT)}..{MAX_OBJECTS - 1}"
    if list(scene.ids) != sorted(set(scene.ids)):
        yield f"objects must be sorted by id, no two alike; their ids are {list(scene.ids)}"
    if scene.target_id is not None and scene.target_id not in scene.ids:
        yield f"target_id is {scene.target_id}, which is not in sight; it must be None while the target is not"
    if TARGET_ID in scene.ids and scene.target_id != TARGET_ID:
        yield f"object {TARGET_ID} is in sight and not the target: number objects from {TARGET_ID + 1} on"
    for o in scene.objects:
        columns = {"points": o.points, "normals": o.normals}
        bad = [n for n, a in columns.items() if a.shape != (len(o.pixels), 3) or a.dtype != np.float32]
        if bad:
            yield f"object {o.id}: {bad[0]} must be a float32 array of shape ({len(o.pixels)}, 3), as many as pixels"
        elif not len(o.points):
            yield f"object {o.id} has no points: leave it out"
        elif not np.isfinite(o.points).all():
            yield f"object {o.id}: points must be finite"
        elif np.abs(np.linalg.norm(o.normals, axis=1) - 1).max() > _UNIT_TOLERANCE:
            yield f"object {o.id}: normals must have length 1"
        elif (label[o.pixels[:, 0], o.pixels[:, 1]] != o.id).any():
            yield f"object {o.id}: its pixels must carry its id in label_image"
