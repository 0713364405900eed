"""Planning contexts for tests: small scenes with handmade grasps, and random clutter of any size."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from torc.errors import InputError
from torc.occlusion.volume import empty_volume, update_volume
from torc.perception.checked_scenes import ask_perception
from torc.perception.protocol import Wanted
from torc.perception.segmentation import LabelPerception, PerceptionConfig
from torc.records import (
    TARGET_ID,
    Capture,
    GraspReport,
    GraspSet,
    GraspStatus,
    PickOutcome,
    PlanningContext,
    SegmentedScene,
    VoxelGrid,
)
from torc.testing.synthetic import Shape, SyntheticBox, random_clutter, synthetic_capture
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

_Fate = tuple[int, GraspStatus, tuple[int, ...]]
"""A grasp: its object, its status, its blockers."""
_DOF = 7
_TABLE_Z_M = 1.05
_COARSE = VoxelGrid(np.array([0.42, -0.62, _TABLE_Z_M]), 0.02, (30, 51, 21))


def small_mount() -> CameraMount:
    """Return the torso camera at 320x240: fast, and sharp enough for household objects."""
    return replace(load_workspace().camera, width=320, height=240)


def box(
    object_id: int, x: float, y: float, size: tuple[float, float, float], on: float = 0.0
) -> SyntheticBox:
    """Return a box of these edge lengths that stands at (x, y) on the table, or `on` metres above it."""
    return SyntheticBox(object_id, (x, y, _TABLE_Z_M + on + size[2] / 2), size)


def perceive(shapes: Sequence[Shape], mount: CameraMount | None = None) -> SegmentedScene:
    """Return the scene that a camera, by default the small one, perceives of these shapes, labels given."""
    return see(synthetic_capture(shapes, mount or small_mount()))


def see(capture: Capture, config: PerceptionConfig | None = None) -> SegmentedScene:
    """Return what the perception `labels` finds in a capture."""
    return ask_perception(LabelPerception(config), capture, Wanted(""), None)


def make_context(
    shapes: Sequence[Shape],
    valid: Mapping[int, int] | None = None,
    blocked: Mapping[int, Sequence[Sequence[int]]] | None = None,
    *,
    unreachable: Mapping[int, int] | None = None,
    history: tuple[PickOutcome, ...] = (),
    picks_left: int = 15,
) -> PlanningContext:
    """Return a planner's context of these shapes, with grasps at the objects' centres and an agreeing report.

    The target is the shape with id 0; it is hidden if there is none, or nothing of it is in sight. `valid` is how many
    valid grasps each object has, `unreachable` how many without inverse kinematics; `blocked` has the blockers of each
    of an object's blocked grasps, e.g. {2: [(3,), (3, 4)]}. Raises InputError for grasps of what is not visible.
    """
    fates: list[_Fate] = [(k, GraspStatus.VALID, ()) for k, n in (valid or {}).items() for _ in range(n)]
    fates += [(k, GraspStatus.BLOCKED, tuple(by)) for k, grasps in (blocked or {}).items() for by in grasps]
    fates += [(k, GraspStatus.UNREACHABLE, ()) for k, n in (unreachable or {}).items() for _ in range(n)]
    return _context(perceive(shapes), fates, history, picks_left)


def open_context() -> PlanningContext:
    """Return a scene in which the target stands free and is graspable, beside another object."""
    shapes = (box(0, 0.62, 0.0, (0.05, 0.05, 0.10)), box(1, 0.62, -0.2, (0.05, 0.05, 0.12)))
    return make_context(shapes, valid={0: 3, 1: 2})


def behind_context() -> PlanningContext:
    """Return a scene in which the target 0 peeks out behind 1, which blocks its grasps; 2 stands apart.

    1 and 2 are graspable.
    """
    shapes = (
        box(0, 0.72, -0.1, (0.06, 0.06, 0.20)),
        box(1, 0.60, -0.1, (0.06, 0.08, 0.12)),
        box(2, 0.60, 0.1, (0.05, 0.05, 0.10)),
    )
    return make_context(shapes, valid={1: 2, 2: 4}, blocked={0: [(1,), (1,), (1,)]})


def stacked_context() -> PlanningContext:
    """Return a scene in which 1 lies on the target 0; both are graspable."""
    shapes = (box(0, 0.65, -0.1, (0.14, 0.14, 0.06)), box(1, 0.66, -0.1, (0.06, 0.06, 0.06), on=0.06))
    return make_context(shapes, valid={0: 1, 1: 2})


def hidden_context() -> PlanningContext:
    """Return a scene without a target in sight; a large box 1 and a small one 2, both graspable."""
    shapes = (box(1, 0.60, -0.2, (0.06, 0.20, 0.20)), box(2, 0.60, 0.1, (0.04, 0.04, 0.05)))
    return make_context(shapes, valid={1: 1, 2: 3})


def single_context() -> PlanningContext:
    """Return a scene with one object, graspable, not the target."""
    return make_context((box(1, 0.62, -0.1, (0.06, 0.06, 0.12)),), valid={1: 2})


def nothing_graspable_context() -> PlanningContext:
    """Return a scene with two objects in sight, the target among them, and no valid grasp."""
    shapes = (box(0, 0.72, -0.1, (0.06, 0.06, 0.20)), box(1, 0.60, -0.1, (0.06, 0.08, 0.12)))
    return make_context(shapes, blocked={0: [(1,)]}, unreachable={1: 2})


def empty_context() -> PlanningContext:
    """Return a scene with nothing in sight."""
    return make_context(())


def cluttered_context(
    objects: int, seed: int, mount: CameraMount | None = None, hidden_target: bool = False
) -> PlanningContext:
    """Return random clutter with plausible grasps; `hidden_target` removes the target's shape.

    Objects with others between them and the camera have mostly blocked grasps, the more the nearer the others are.
    """
    rng = np.random.default_rng(seed)
    shapes = random_clutter(rng, objects)
    scene = perceive([s for s in shapes if not (hidden_target and s.id == TARGET_ID)], mount)
    fates: list[_Fate] = []
    centers = {o.id: np.median(o.points, axis=0).astype(float) for o in scene.objects}
    camera = scene.observation.T_world_camera[:3, 3]
    for k, center in centers.items():
        nearer = [j for j, c in centers.items() if j != k and _in_the_way(c, center, camera)]
        total = int(rng.integers(0, 8))
        free = total if not nearer else int(rng.integers(0, 2)) * int(rng.random() < 0.3)
        fates += [(k, GraspStatus.VALID, ())] * free
        for _ in range(total if nearer else 0):
            by = tuple(rng.permutation(nearer)[: rng.integers(1, 3)].tolist())
            fates.append((k, GraspStatus.BLOCKED, by))
    return _context(scene, fates)


def _in_the_way(other: np.ndarray, center: np.ndarray, camera: np.ndarray) -> bool:
    """True if the other one is nearer to the camera, and within 8 cm of the line of sight seen from above."""
    sight = (center - camera)[:2] / np.linalg.norm((center - camera)[:2])
    offset = (other - center)[:2]
    along, across = offset @ sight, abs(offset[0] * sight[1] - offset[1] * sight[0])
    return bool(-0.20 < along < 0 and across < 0.08)


def _context(
    scene: SegmentedScene, fates: list[_Fate], history: tuple[PickOutcome, ...] = (), picks_left: int = 15
) -> PlanningContext:
    named = {k for k, _, by in fates for k in (k, *by)}
    if not named <= set(scene.ids):
        raise InputError(f"Grasps name {sorted(named)}, but only {scene.ids} are visible.")
    fates.sort(key=lambda fate: fate[0])
    volume = update_volume(empty_volume(_COARSE), scene)
    grasps, report = _grasp_set(scene, fates), _report(scene, fates)
    return PlanningContext(scene, volume, grasps, report, "the blue tuna can", history, picks_left)


def _grasp_set(scene: SegmentedScene, fates: list[_Fate]) -> GraspSet:
    n = len(fates)
    Ts = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (n, 1, 1))  # approach straight down
    for T, (k, _, _) in zip(Ts, fates):
        T[:3, 3] = np.median(scene.object(k).points, axis=0)
    reach = np.array([[-0.02, 0, 0], [0.02, 0, 0]])
    return GraspSet(
        Ts_world_tcp=Ts,
        widths_m=np.full(n, 0.04),
        scores=np.linspace(0.9, 0.5, n),
        object_ids=np.array([k for k, _, _ in fates], dtype=np.int16),
        contacts=Ts[:, None, :3, 3] + reach,
        generators=np.zeros(n, dtype=np.uint8),
        generator_names=("stated by hand",),
    )


def _report(scene: SegmentedScene, fates: list[_Fate]) -> GraspReport:
    ids = scene.ids
    place = {k: i for i, k in enumerate(ids)}
    blocking = np.zeros((len(ids), len(ids)), dtype=np.int32)
    blocked_total = np.zeros(len(ids), dtype=np.int32)
    valid_total = np.zeros(len(ids), dtype=np.int32)
    for k, status, by in fates:
        valid_total[place[k]] += status == GraspStatus.VALID
        blocked_total[place[k]] += status == GraspStatus.BLOCKED
        for j in by:
            blocking[place[k], place[j]] += 1
    qpos = np.zeros((len(fates), _DOF))
    qpos[[status == GraspStatus.UNREACHABLE for _, status, _ in fates]] = np.nan
    return GraspReport(
        status=np.array([status for _, status, _ in fates], dtype=np.uint8),
        qpos=qpos,
        blockers=np.array([sum(1 << j for j in by) for _, _, by in fates], dtype=np.uint64),
        object_ids=ids,
        blocking=blocking,
        blocked_total=blocked_total,
        valid_total=valid_total,
    )
