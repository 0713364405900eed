"""An annotated scene, put on our table and brought to rest; or why it does not come to rest."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from torc.errors import PhysicsError
from torc.generation.graspclutter6d.alignment import TableScene, align_to_table
from torc.generation.graspclutter6d.annotations import ANNOTATION, CAMERA, AnnotatedScene
from torc.generation.graspclutter6d.masks import mask_notes
from torc.generation.graspclutter6d.objects import ConvertedObject, check_meshes, convert_object
from torc.generation.graspclutter6d.placement import place_objects, placement_rule
from torc.generation.graspclutter6d.published import object_words
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.easing import EaseConfig, EaseReport, ease_apart
from torc.sim.settling import SettleConfig, settle, with_poses_of
from torc.sim.stillness import StillnessConfig, watch_stillness
from torc.sim.world import Presence, World, build_world
from torc.workspace.description import Workspace

_TWINS = {401: 404, 404: 401}
_ALONE = "nothing stands around a target: choose another scene"

Say = Callable[[str], None]


@dataclass(frozen=True)
class ImportConfig:
    """How a scene is taken over.

    Attributes:
        placement: "torc" or "paper": where on the table it goes.
        annotation, camera: the picture whose annotation is taken; the paper's by default.
        ease: how objects inside each other are pushed apart first.
        settle: when it counts as settled ...
        still: ... and as still; a scene that is not gets more time, `patience` times in all.
    """

    placement: str = "torc"
    annotation: int = ANNOTATION
    camera: str = CAMERA
    ease: EaseConfig = field(default_factory=EaseConfig)
    settle: SettleConfig = field(default_factory=lambda: SettleConfig(limit_s=10.0))
    still: StillnessConfig = field(default_factory=lambda: StillnessConfig(early_s=2.0))
    patience: int = 8


@dataclass(frozen=True)
class SettledScene:
    """A scene at rest on our table.

    Attributes:
        scene: its number.
        problem: what is still on the table, where it came to rest; its target is only a stand-in.
        annotated: where the annotation had put all objects, by name.
        fell: names of the objects that fell off the table; they are not in the problem.
        notes: what was odd, for people.
    """

    scene: int
    problem: Problem
    annotated: dict[str, ObjectPlacement]
    fell: tuple[str, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class SceneFailure:
    """Why a scene, or a target in it, gives no problem."""

    scene: int
    target: str | None
    reason: str
    notes: tuple[str, ...] = ()


def settle_scene(
    root: Path, annotated: AnnotatedScene, config: ImportConfig | None = None, say: Say = lambda _: None
) -> SettledScene | SceneFailure:
    """Puts an annotated scene on our table and lets it come to rest.

    Args:
        root: of the data set, for the meshes; converted ones are kept in the user's object store.
        annotated: see `read_scene`.
        config: where and how.
        say: told what takes long.

    Raises:
        InputError: annotation or meshes cannot be used.
    """
    config = config or ImportConfig()
    table = align_to_table(annotated)
    notes = [*table.notes, *mask_notes(annotated), *_twin_note(annotated.scene)]
    if len(table.objects) < 2:
        return SceneFailure(table.scene, None, f"it has one object only, so {_ALONE}", tuple(notes))
    objects = _convert(root, table, say)
    notes += [f"{o.model.name}: {note}" for o in objects.values() for note in o.notes]
    placements = place_objects(table, objects, placement_rule(config.placement))
    raw = Problem(f"gc6d-{table.scene}", "unstructured", "", placements[0].name, placements)
    say(f"scene {table.scene}: settling {len(placements)} objects")
    world = build_world(raw, None, Workspace())
    try:
        eased = ease_apart(world, config.ease)
        restless = _settle(world, config)
    except PhysicsError as error:
        restless = f"could not be settled: {error}"
    if restless:
        return SceneFailure(table.scene, None, restless, tuple(notes))
    on_table = {raw.ordered()[i].name for i in world.on_table()}
    fell = tuple(o.name for o in placements if o.name not in on_table)
    if len(on_table) < 2:
        reason = f"{len(fell)} of {len(placements)} objects fell off the table, so {_ALONE} or --placement"
        return SceneFailure(table.scene, None, reason, tuple(notes))
    rest = tuple(o for o in with_poses_of(world).objects if o.name in on_table)
    annotated_poses = {o.name: o for o in placements}
    notes += _settling_notes(eased, fell, annotated_poses, rest)
    problem = replace(raw, objects=rest, target=rest[0].name)
    return SettledScene(table.scene, problem, annotated_poses, fell, tuple(notes))


def _settle(world: World, config: ImportConfig) -> str:
    """Lets a world come to rest, and takes away what falls off; why it does not come to rest, or nothing."""
    for _ in range(config.patience):
        report = settle(world, config.settle)
        if not report.settled:
            speed = f"an object still moves at {1000 * report.max_speed_m_s:.0f} mm/s"
            return f"not at rest after {report.duration_s:.0f} s: {speed}"
        for object_id in report.left:
            world.park(object_id, Presence.DROPPED)
        stillness = watch_stillness(world, config.still)
        if stillness.still:
            return ""
    crept = f"{1000 * stillness.distance_m:.1f} mm, {np.rad2deg(stillness.angle_rad):.1f} degrees"
    return f"never still: an object still crept {crept} in {stillness.watched_s:.1f} s"


def _twin_note(scene: int) -> tuple[str, ...]:
    if scene not in _TWINS:
        return ()
    return (f"the data set holds this scene twice, as {scene} and as {_TWINS[scene]}",)


def _convert(root: Path, table: TableScene, say: Say) -> dict[int, ConvertedObject]:
    ids = list(dict.fromkeys(o.object_id for o in table.objects))
    check_meshes(root, ids)
    return {i: convert_object(root, i, object_words(i), say) for i in ids}


def _settling_notes(
    eased: EaseReport,
    fell: Sequence[str],
    annotated: dict[str, ObjectPlacement],
    rest: Sequence[ObjectPlacement],
) -> list[str]:
    moved_mm = [
        1000 * float(np.linalg.norm(np.subtract(o.position, annotated[o.name].position)[:2])) for o in rest
    ]
    notes = [
        f"settling moved objects sideways by {np.median(moved_mm):.0f} mm (median), {max(moved_mm):.0f} mm at most"
    ]
    if eased.steps:
        before, after = 1000 * eased.before_m, 1000 * eased.after_m
        notes.append(f"objects up to {before:.0f} mm inside each other were eased apart, to {after:.0f} mm")
    if fell:
        notes.append(f"fell off the table and left out: {', '.join(fell)}")
    return notes
