"""An annotated scene, put on our table and brought to rest; or why it does not come to rest."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from torc.errors import InputError, PhysicsError, UnknownNameError
from torc.generation.graspclutter6d.objects import ConvertedObject, check_meshes, convert_object
from torc.generation.graspclutter6d.published import object_words
from torc.generation.graspclutter6d.reading import ANNOTATION, CAMERA, AnnotatedScene
from torc.geometry.transforms import invert, transform_points, wxyz_from_rotation
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.settling import EaseConfig, EaseReport, SettleConfig, ease_apart, settle, with_poses_of
from torc.sim.stillness import StillnessConfig, watch_stillness
from torc.sim.world import Presence, World, build_world
from torc.workspace.files import load_workspace

PLACEMENTS = {
    # Where the arm reaches best; the fall is short, so that what stands keeps standing.
    "torc": (0.65, -0.12, 0.005),
    # As the retrieval paper's converter does it: make_mjcf.py in
    # https://github.com/DanManN/graspclutter6d_mujoco_sim puts the scene's box 5 cm before the middle (.8, 0, 1.05) of
    # the table and 3 cm above it.
    "paper": (0.75, 0.0, 0.03),
}
"""Where the bounding box of a whole scene goes: x and y of its middle in the world, and how far its lower side is above
the table, for the annotated heights are only good to centimetres; metres."""
_ALONE = "nothing stands around a target: choose another scene"

Say = Callable[[str], None]


@dataclass(frozen=True)
class ImportConfig:
    """How a scene is taken over.

    Attributes:
        placement: one of PLACEMENTS.
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

    def __post_init__(self) -> None:
        if self.placement not in PLACEMENTS:
            raise UnknownNameError("placement", self.placement, list(PLACEMENTS))


@dataclass(frozen=True)
class SettledScene:
    """A scene at rest on our table.

    Attributes:
        number: of the scene.
        problem: what is still on the table, where it came to rest; its target is only a stand-in.
        annotated: where the annotation had put all objects, by name.
        fell: names of the objects that fell off the table; they are not in the problem.
        notes: what was odd, for people.
    """

    number: int
    problem: Problem
    annotated: dict[str, ObjectPlacement]
    fell: tuple[str, ...]
    notes: tuple[str, ...]


def settle_scene(
    root: Path, scene: AnnotatedScene, config: ImportConfig | None = None, say: Say = lambda _: None
) -> SettledScene:
    """Puts an annotated scene on our table and lets it come to rest.

    Args:
        root: of the data set, for the meshes; converted ones are kept in the user's object store.
        scene: see `read_scene`.
        config: where and how.
        say: told what takes long.

    Raises:
        InputError: meshes cannot be used, the scene does not come to rest, or fewer than two objects are left.
    """
    config = config or ImportConfig()
    if len(scene.objects) < 2:
        raise InputError(f"it has one object only, so {_ALONE}")
    ids = list(dict.fromkeys(o.object_id for o in scene.objects))
    check_meshes(root, ids)
    objects = {i: convert_object(root, i, object_words(i), say) for i in ids}
    placements = place_objects(scene, objects, config.placement)
    raw = Problem(f"gc6d-{scene.number}", "unstructured", "", placements[0].name, placements)
    say(f"scene {scene.number}: settling {len(placements)} objects")
    world = build_world(raw, None, load_workspace())
    try:
        eased = ease_apart(world, config.ease)
        _settle(world, config)
    except PhysicsError as error:
        raise InputError(f"could not be settled: {error}") from None
    on_table = {raw.ordered()[i].name for i in world.on_table()}
    fell = tuple(o.name for o in placements if o.name not in on_table)
    if len(on_table) < 2:
        raise InputError(
            f"{len(fell)} of {len(placements)} objects fell off the table, so {_ALONE} or --placement"
        )
    rest = tuple(o for o in with_poses_of(world).objects if o.name in on_table)
    annotated = {o.name: o for o in placements}
    notes = (
        *scene.notes,
        *(f"{o.model.name}: {note}" for o in objects.values() for note in o.notes),
        *_settling_notes(eased, fell, annotated, rest),
    )
    return SettledScene(scene.number, replace(raw, objects=rest, target=rest[0].name), annotated, fell, notes)


def place_objects(
    scene: AnnotatedScene, objects: Mapping[int, ConvertedObject], placement: str
) -> tuple[ObjectPlacement, ...]:
    """The scene's objects (by object id) in the world, in file order: turned as annotated, moved as a whole."""
    converted = [objects[o.object_id] for o in scene.objects]
    poses = [o.T_table_mesh @ invert(c.T_object_mesh) for o, c in zip(scene.objects, converted)]
    points = np.concatenate([transform_points(T, c.visible_points) for T, c in zip(poses, converted)])
    lower, upper = points.min(axis=0), points.max(axis=0)
    x, y, above_m = PLACEMENTS[placement]
    shift = np.array([x, y, load_workspace().support_z_m + above_m]) - [*(lower + upper)[:2] / 2, lower[2]]
    placements = []
    for o, c, T in zip(scene.objects, converted, poses):
        x, y, z = (float(v) for v in T[:3, 3] + shift)
        qw, qx, qy, qz = (float(v) for v in wxyz_from_rotation(T[:3, :3]))
        placements.append(ObjectPlacement(o.name, c.model.name, (x, y, z), (qw, qx, qy, qz)))
    return tuple(placements)


def _settle(world: World, config: ImportConfig) -> None:
    """Lets a world come to rest, and takes away what falls off. Raises InputError if it does not come to rest."""
    for _ in range(config.patience):
        report = settle(world, config.settle)
        if not report.settled:
            speed = f"an object still moves at {1000 * report.max_speed_m_s:.0f} mm/s"
            raise InputError(f"not at rest after {report.duration_s:.0f} s: {speed}")
        for object_id in report.left:
            world.park(object_id, Presence.DROPPED)
        stillness = watch_stillness(world, config.still)
        if stillness.still:
            return
    crept = f"{1000 * stillness.distance_m:.1f} mm, {np.rad2deg(stillness.angle_rad):.1f} degrees"
    raise InputError(f"never still: an object still crept {crept} in {stillness.watched_s:.1f} s")


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
