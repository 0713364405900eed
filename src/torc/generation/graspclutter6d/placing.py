"""An annotated scene, put on our table and brought to rest; or the reason why it does not come to rest."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from torc.errors import InputError, PhysicsError, UnknownNameError
from torc.generation.graspclutter6d.reading import (
    ANNOTATION,
    CAMERA,
    AnnotatedScene,
    object_stem,
    object_words,
)
from torc.geometry.transforms import Pose, invert, transform_points, wxyz_from_rotation
from torc.objects.importing.mesh import MeshImport, MeshOptions, read_mesh
from torc.objects.importing.storing import add_object
from torc.objects.library import find_stored, load_stored, store_directories
from torc.objects.models import ObjectModel
from torc.objects.object_files import load_source
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.settling import (
    EASED_M,
    SettleConfig,
    StillnessConfig,
    ease_apart,
    settle,
    watch_stillness,
    with_poses_of,
)
from torc.sim.simulated_world import Presence, World, build_world
from torc.workspace.workspace_files import load_workspace

LICENCE = "GraspClutter6D, CC-BY-SA-4.0"
_FOLDERS = {
    "models_obj_m": ("obj", 1.0),
    "models_m": ("ply", 1.0),
    "models_obj": ("obj", 1e-3),
    "models": ("ply", 1e-3),
    "models_obj_eval": ("obj", 1e-3),
    "models_eval": ("ply", 1e-3),
}
"""Folders of meshes, the best first: ending and unit in metres."""


@dataclass(frozen=True, eq=False)
class ConvertedObject:
    """An object of the data set as one of ours; with changes to the mesh and oddities, if it was converted just now."""

    model: ObjectModel
    T_object_mesh: Pose
    notes: tuple[str, ...]


def find_mesh(root: Path, object_id: int) -> tuple[Path, float]:
    """Return the first mesh of an object in the order of `_FOLDERS`, and its unit in metres. Raises InputError."""
    name = object_stem(object_id)
    for folder, (ending, unit_m) in _FOLDERS.items():
        # obj2mjcf moves each mesh into its own folder.
        for path in (root / folder / f"{name}.{ending}", root / folder / name / f"{name}.{ending}"):
            if path.is_file():
                return path, unit_m
    raise InputError(
        f"{root} has no mesh of {name}. Unpack one of {', '.join(f'{f}.7z' for f in _FOLDERS)} there; models_obj_m is "
        "the best."
    )


def convert_object(root: Path, object_id: int, words: str, say: Callable[[str], None]) -> ConvertedObject:
    """Return an object of the data set (1..200) from the store, or convert and store it, which takes up to a minute.

    `words` describe it. Raises InputError if it has no usable mesh, or the store holds another object of that name, and
    MissingDependencyError without the extra `import`.
    """
    name, notes = _model_name(object_id), tuple[str, ...]()
    stored = find_stored(name)
    if stored is None:
        say(f"converting {name}: {words}")
        found = _read(*find_mesh(root, object_id), name, words)
        add_object(found, note=LICENCE)
        stored, notes = store_directories()[0] / name, found.notes
    source = load_source(stored)
    if source.note != LICENCE:
        raise InputError(
            f"{stored} is not from GraspClutter6D, but has the name of one of its objects. Move it away."
        )
    return ConvertedObject(load_stored(stored), source.T_object_mesh, notes)


def _model_name(object_id: int) -> str:
    """Return the name of an object in the store: gc6d_000017."""
    return f"gc6d_{object_id:06d}"


def _read(path: Path, unit_m: float, name: str, words: str) -> MeshImport:
    """Read the mesh in its folder's unit, or in the other one if only that gives a possible size."""
    options = MeshOptions(name=name, description=words, scale=unit_m)
    try:
        return read_mesh(path, options)
    except InputError as error:
        with suppress(InputError):
            return read_mesh(path, replace(options, scale=1e-3 / unit_m))
        raise error from None


Placement = Literal["torc", "paper"]
PLACEMENTS: Mapping[Placement, tuple[float, float, float]] = {
    # Where the arm reaches best; the fall is short, so that standing objects stay upright.
    "torc": (0.65, -0.12, 0.005),
    # Like the retrieval paper's converter: make_mjcf.py in
    # https://github.com/DanManN/graspclutter6d_mujoco_sim puts the scene's box 5 cm before the middle (.8, 0, 1.05) of
    # the table and 3 cm above it.
    "paper": (0.75, 0.0, 0.03),
}
"""Place of the bounding box of a whole scene: x and y of its middle in the world, and the height of its lower side
above the table, since the annotated heights are only good to centimetres; metres.
"""
Say = Callable[[str], None]


@dataclass(frozen=True)
class ImportConfig:
    """How a scene is imported: one of PLACEMENTS, and the picture whose annotation is used, by default the paper's.

    Objects inside each other are pushed apart first. A scene that is not still after it has settled gets more time,
    `patience` times in all.
    """

    placement: Placement = "torc"
    annotation: int = ANNOTATION
    camera: str = CAMERA
    settle: SettleConfig = field(default_factory=lambda: SettleConfig(limit_s=10.0))
    still: StillnessConfig = field(default_factory=lambda: StillnessConfig(early_s=2.0))
    patience: int = 8

    def __post_init__(self) -> None:
        if self.placement not in PLACEMENTS:
            raise UnknownNameError("placement", self.placement, list(PLACEMENTS))


@dataclass(frozen=True)
class SettledScene:
    """A scene at rest on our table: the remaining objects, as a problem whose target is only a stand-in; where the
    annotation had put all, by name; those that fell off the table; and oddities, for people.
    """

    number: int
    problem: Problem
    annotated: dict[str, ObjectPlacement]
    fell: tuple[str, ...]
    notes: tuple[str, ...]


def settle_scene(
    root: Path, scene: AnnotatedScene, config: ImportConfig | None = None, say: Say = lambda _: None
) -> SettledScene:
    """Put an annotated scene on our table and let it come to rest.

    Converted meshes of the data set (`root`) are kept in the user's object store. Raises InputError if meshes cannot be
    used, the scene does not come to rest, or fewer than two objects are left.
    """
    config = config or ImportConfig()
    if len(scene.objects) < 2:
        raise InputError("it has one object only, so nothing stands around a target: choose another scene")
    ids = list(dict.fromkeys(o.object_id for o in scene.objects))
    for object_id in ids:  # before any is converted, which takes long
        if find_stored(_model_name(object_id)) is None:
            find_mesh(root, object_id)
    objects = {i: convert_object(root, i, object_words(i), say) for i in ids}
    placements = place_objects(scene, objects, config.placement)
    raw = Problem(f"gc6d-{scene.number}", "unstructured", "", placements[0].name, placements)
    say(f"scene {scene.number}: settling {len(placements)} objects")
    world = build_world(raw, None, load_workspace())
    try:
        before_m, after_m = ease_apart(world)
        _settle(world, config)
    except PhysicsError as error:
        raise InputError(f"could not be settled: {error}") from None
    on_table = {raw.ordered()[i].name for i in world.on_table()}
    fell = tuple(o.name for o in placements if o.name not in on_table)
    if len(on_table) < 2:
        raise InputError(
            f"only {len(on_table)} of {len(placements)} objects stay on the table, so nothing stands around a target: "
            "choose another scene or --placement"
        )
    rest = tuple(o for o in with_poses_of(world).objects if o.name in on_table)
    annotated = {o.name: o for o in placements}
    notes = [f"{o.model.name}: {note}" for o in objects.values() for note in o.notes]
    if before_m > EASED_M:
        before, after = 1000 * before_m, 1000 * after_m
        notes.append(f"objects up to {before:.0f} mm inside each other were eased apart, to {after:.0f} mm")
    if fell:
        notes.append(f"fell off the table and left out: {', '.join(fell)}")
    problem = replace(raw, objects=rest, target=rest[0].name)
    return SettledScene(scene.number, problem, annotated, fell, tuple(notes))


def place_objects(
    scene: AnnotatedScene, objects: Mapping[int, ConvertedObject], placement: Placement
) -> tuple[ObjectPlacement, ...]:
    """Place the scene's objects (by object id) in the world, in file order: turned as annotated, moved as a whole."""
    converted = [objects[o.object_id] for o in scene.objects]
    poses = [o.T_table_mesh @ invert(c.T_object_mesh) for o, c in zip(scene.objects, converted)]
    points = np.concatenate(
        [transform_points(T, v.vertices) for T, c in zip(poses, converted) for v in c.model.visuals]
    )
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
    """Let a world come to rest, and remove what falls off. Raises InputError if it does not come to rest."""
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
