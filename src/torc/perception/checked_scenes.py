"""Ask any perception, camera or depth, and check that its result can be used."""

from collections.abc import Callable, Iterable, Iterator
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

_UNIT_TOLERANCE = 1e-3


def ask_perception(
    perception: Perception, capture: Capture, wanted: Wanted, before: SegmentedScene | None
) -> SegmentedScene:
    """Return the scene that a perception makes of a snapshot; it receives the label image only if it needs labels.

    Raises PartError if it crashed or did not return a scene of this snapshot; its own TorcError passes unchanged.
    """
    needs_labels = PERCEPTIONS.traits(perception).needs_labels
    given: dict[str, Any] = {"label_image": capture.label_image} if needs_labels else {}
    scene: SegmentedScene = _asked(
        "Perception",
        perception,
        lambda: perception.perceive(capture.observation, wanted, before, **given),
        lambda scene: scene_faults(scene, capture.observation),
    )
    return scene


def ask_recognition(
    perception: Perception,
    observation: Observation,
    mask: Bool[np.ndarray, "h w"],
    wanted: Wanted,
    scene: SegmentedScene,
    object_id: int,
) -> float | None:
    """Return what a perception's method `recognise` gives; see `Perception`. Raises PartError as `ask_perception`."""
    recognise: Any = perception.recognise  # type: ignore[attr-defined]
    p = _asked(
        "Perception",
        perception,
        lambda: recognise(observation, mask, wanted, scene, object_id),
        lambda p: [] if p is None or 0 <= p <= 1 else [f"recognise returned {p!r}, which is no probability"],
    )
    return None if p is None else float(p)


def ask_camera(camera: Camera | Robot) -> Capture:
    """Return a snapshot from a camera, or from a robot that has one. Raises PartError as `ask_perception`."""
    capture: Capture = _asked("Camera", camera, lambda: as_capture(camera.capture()), _capture_faults)
    return capture


def _capture_faults(capture: Capture) -> Iterator[str]:
    yield from observation_faults(capture.observation, "capture()")
    if capture.label_image is not None and capture.label_image.shape != capture.observation.depth_m.shape:
        yield "its label image has another size than depth_m"


def ask_depth(depth: Depth, observation: Observation) -> Observation:
    """Return the snapshot with the depth to use. Raises PartError as `ask_perception`."""
    measured: Observation = _asked(
        "Depth", depth, lambda: depth.measure(observation), lambda seen: observation_faults(seen, "measure()")
    )
    return measured


def _asked(kind: str, part: object, ask: Callable[[], Any], faults: Callable[[Any], Iterable[str]]) -> Any:
    """Return a part's answer. Raises PartError if it crashed, or for the first fault of its answer."""
    what, name = f"{kind} {type(part).__name__}", kind.lower()
    remedy = f"torc.testing.{name}_conformance checks a {name} against all rules (docs/extending.md)."
    with blamed(what, PartError, remedy):
        answer = ask()
        for fault in faults(answer):
            raise PartError(f"{what} gave no valid result: {fault}. {remedy}")
    return answer


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
    if scene.target_id is None and scene.target_number in scene.ids and scene.target_number != TARGET_ID:
        yield f"known takes object {scene.target_number} for the target, and target_id is None: use with_target(None)"
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
