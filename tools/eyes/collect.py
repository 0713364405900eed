"""Scenes and views to learn from: settled clutter, seen by many cameras, with exact depth and depth from a stereo pair.

Every scene is a function of (seed, number of the scene), so that a collection that was interrupted goes on as if it had
not been. A scene's file holds what its views show of the objects and of a rim around them.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from tools.eyes.looks import LookConfig, camera, relight, repaint, rig
from tools.grasp_model.scenes import without
from torc.errors import InputError, PhysicsError
from torc.generation.arrangements import StructuredConfig, drop_arrangement, structured_arrangement
from torc.generation.sampling import sample_models
from torc.perception.embedded.model import crop
from torc.perception.stereo import SgbmConfig, sgbm_depth
from torc.problems.problem import Problem
from torc.problems.schema import Category
from torc.sim.portraits import portrait_camera, turned_about
from torc.sim.rendering import CameraRenderer, View
from torc.sim.settling import COARSE, DumpConfig, SettleReport, dump, settle_problem
from torc.sim.simulated_world import Presence, World, build_world
from torc.sim.stereo_camera import stereo_pair
from torc.workspace.description import CameraMount, Workspace

DEPTH_UNIT_M = 0.0001
_PORTRAIT_PX = (160, 120)
BACKGROUND = 255
"""In a view's labels."""


@dataclass(frozen=True)
class CollectConfig:
    """What scenes are made of and how often each is looked at.

    Attributes:
        counts: shares of scenes with up to so many objects; drawn evenly within.
        structured_share: share of arrangements of standing objects; the others are dumped piles.
        views: per scene.
        rim_m: how much around the objects is kept, about.
        min_pixels: views that show fewer pixels of objects are left out.
        sides: portraits of each object.
    """

    counts: tuple[tuple[int, float], ...] = ((4, 0.15), (16, 0.6), (40, 0.25))
    structured_share: float = 0.5
    views: int = 12
    rim_m: float = 0.10
    min_pixels: int = 800
    sides: int = 4
    looks: LookConfig = field(default_factory=LookConfig)


@dataclass(frozen=True)
class SavedView:
    """What one camera saw of a scene, cut to the objects and a rim around them.

    Attributes:
        rgb, depth_m, stereo_m: colour; exact depth, and depth by semi-global matching; 0 for no reading.
        label: object id, or BACKGROUND.
        K: intrinsics of the cut.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    stereo_m: Float32[np.ndarray, "h w"]
    label: UInt8[np.ndarray, "h w"]
    K: Float[np.ndarray, "3 3"]
    T_world_camera: Float[np.ndarray, "4 4"]
    support_z_m: float


def make_scene(
    models: Sequence[str], workspace: Workspace, rng: np.random.Generator, config: CollectConfig
) -> Problem | None:
    """A settled scene; None if it fell apart."""
    limits = [0, *(most for most, _ in config.counts)]
    part = int(rng.choice(len(config.counts), p=[share for _, share in config.counts]))
    count = int(rng.integers(limits[part] + 1, limits[part + 1] + 1))
    names = sample_models(count, rng, models=models)
    structured = bool(rng.random() < config.structured_share)
    for _ in range(3):
        with suppress(PhysicsError, InputError):
            problem, report = _settled(names, structured and count <= 24, workspace, rng)
            problem = without(problem, [problem.ordered()[i].name for i in report.left])
            if problem.objects and report.max_speed_m_s < 0.05:
                return problem
    return None


def _settled(
    names: list[str], structured: bool, workspace: Workspace, rng: np.random.Generator
) -> tuple[Problem, SettleReport]:
    category: Category = "structured" if structured else "unstructured"
    if structured:
        arrangement = StructuredConfig(
            support_z_m=workspace.support_z_m,
            turned_rad=float(rng.choice([0.3, 1.5])),
            gap_m=(0.003, float(rng.choice([0.008, 0.02, 0.08]))),
            restarts=3,
        )
        if len(names) > 12:
            arrangement = replace(arrangement, region=((0.46, 0.84), (-0.42, 0.18)))
        objects = tuple(structured_arrangement(names, rng, arrangement))
        return settle_problem(
            Problem("eyes", category, "", objects[0].name, objects), workspace, None, COARSE
        )
    objects = tuple(drop_arrangement(names, rng))
    spread = rng.uniform(0.7, 1.1) if len(names) <= 16 else rng.uniform(1.0, 1.3)
    walls = (0.42 * spread, 0.46 * spread)
    scene = Problem("eyes", category, "", objects[0].name, objects)
    return dump(scene, workspace, rng, DumpConfig(walls_size_m=walls, interval_s=0.2), None, COARSE)


def views_of(
    problem: Problem, workspace: Workspace, rng: np.random.Generator, config: CollectConfig
) -> tuple[list[SavedView], UInt8[np.ndarray, "n k s s 4"]]:
    """Views of a settled scene with new paint, each in another light; and portraits of each of its objects alone, as
    crops, from all around.
    """
    world = build_world(problem, None, workspace)
    repaint(world.model, rng, config.looks)
    middle = 0.5 * (world.positions.min(axis=0) + world.positions.max(axis=0))
    views = []
    mounts = [camera(workspace, middle, rng, config.looks) for _ in range(config.views)]
    with CameraRenderer(world, mounts[0]) as renderer:
        for mount in mounts:
            relight(world.model, rng)
            renderer.look_from(mount)
            view = _view(renderer, mount, workspace.support_z_m, rng, config)
            if view is not None:
                views.append(view)
    return views, _portraits(world, rng, config.sides)


def _portraits(world: World, rng: np.random.Generator, sides: int) -> UInt8[np.ndarray, "n k s s 4"]:
    """Each object in its natural pose, alone on the table, as its user may have taken pictures of it."""
    x, y, _ = world.workspace.table.center
    for k in range(world.object_count):
        world.park(k, Presence.ABSENT)
    found = []
    with CameraRenderer(world, portrait_camera(world.models[0], *_PORTRAIT_PX)) as renderer:
        for k, model in enumerate(world.models):
            relight(world.model, rng)
            center = np.array([x, y, world.workspace.support_z_m + model.size_m[2] / 2])
            world.unpark(k, center, np.array([1.0, 0, 0, 0]))
            mount = portrait_camera(model, *_PORTRAIT_PX)
            turns = rng.uniform(-0.4, 0.4) + np.linspace(0, 2 * np.pi, sides, endpoint=False)
            views = [renderer.render(turned_about(mount, center, float(turn))) for turn in turns]
            found.append([crop(v.rgb, v.label_image == k) for v in views])
            world.park(k, Presence.ABSENT)
    return np.array(found, np.uint8)


def _view(
    renderer: CameraRenderer,
    mount: CameraMount,
    support_z_m: float,
    rng: np.random.Generator,
    config: CollectConfig,
) -> SavedView | None:
    left = renderer.render()
    shows = left.label_image >= 0
    if np.count_nonzero(shows) < config.min_pixels:
        return None
    stereo_m = _stereo(renderer, mount, left, rng)
    rows, cols = _cut(shows, left.depth_m, mount.K, config.rim_m)
    K = mount.K.copy()
    K[0, 2] -= cols.start
    K[1, 2] -= rows.start
    label = np.where(shows, left.label_image, BACKGROUND).astype(np.uint8)
    rgb, depth_m, stereo_m, cut_label = (
        np.ascontiguousarray(image[rows, cols]) for image in (left.rgb, left.depth_m, stereo_m, label)
    )
    return SavedView(rgb, depth_m, stereo_m, cut_label, K, mount.T_world_camera, support_z_m)


def _stereo(
    renderer: CameraRenderer, mount: CameraMount, left: View, rng: np.random.Generator
) -> Float32[np.ndarray, "h w"]:
    camera_pair = rig(rng)
    T = mount.T_world_camera.copy()
    T[:3, 3] += camera_pair.baseline_m * T[:3, 0]
    right = renderer.render(T)
    pair = stereo_pair(camera_pair, (left.rgb, right.rgb), (left.depth_m, right.depth_m), mount.K, rng)
    return sgbm_depth(pair, float(mount.K[0, 0]), SgbmConfig(full=bool(rng.random() < 0.3)))


def _cut(
    shows: Bool[np.ndarray, "h w"], depth_m: Float32[np.ndarray, "h w"], K: np.ndarray, rim_m: float
) -> tuple[slice, slice]:
    """Rows and columns of the objects with a rim."""
    rim = int(np.ceil(rim_m * K[0, 0] / float(np.median(depth_m[shows]))))
    spans = []
    for axis, size in ((1, shows.shape[0]), (0, shows.shape[1])):
        there = np.flatnonzero(shows.any(axis=axis))
        spans.append(slice(max(int(there[0]) - rim, 0), min(int(there[-1]) + rim + 1, size)))
    return spans[0], spans[1]


def save_scene(
    path: Path, views: list[SavedView], names: list[str], portraits: UInt8[np.ndarray, "n k s s 4"]
) -> None:
    """Writes a scene's views and portraits; the file appears complete or not at all."""
    arrays: dict[str, np.ndarray] = {"names": np.array(names), "portraits": portraits}
    for i, view in enumerate(views):
        for name in ("rgb", "label", "K", "T_world_camera"):
            arrays[f"{name}_{i}"] = getattr(view, name)
        for name in ("depth_m", "stereo_m"):
            units = np.clip(getattr(view, name) / DEPTH_UNIT_M, 0, 65535)
            arrays[f"{name}_{i}"] = units.round().astype(np.uint16)
        arrays[f"support_z_m_{i}"] = np.array(view.support_z_m)
    aside = path.with_suffix(".part.npz")
    np.savez(aside, **arrays)  # type: ignore[arg-type]
    aside.rename(path)


def scene_files(directory: Path) -> list[Path]:
    """The files of all scenes there, by their numbers."""
    return sorted(directory.glob("scene_[0-9]*[0-9].npz"))


def count_views(path: Path) -> int:
    """How many views a scene's file holds."""
    with np.load(path) as file:
        return sum(name.startswith("K_") for name in file.files)


def load_view(path: Path, index: int) -> SavedView:
    """One view of a scene's file."""
    with np.load(path) as file:
        depths = [
            file[f"{n}_{index}"].astype(np.float32) * np.float32(DEPTH_UNIT_M)
            for n in ("depth_m", "stereo_m")
        ]
        label, K, T, z = (file[f"{n}_{index}"] for n in ("label", "K", "T_world_camera", "support_z_m"))
        return SavedView(file[f"rgb_{index}"], depths[0], depths[1], label, K, T, float(z))


def load_portraits(path: Path) -> UInt8[np.ndarray, "n k s s 4"]:
    """Crops of each object alone, by id and side."""
    with np.load(path) as file:
        return file["portraits"]


def load_names(path: Path) -> list[str]:
    """Model names of a scene's objects, by id."""
    with np.load(path) as file:
        return [str(n) for n in file["names"]]


def collect_scene(
    out: Path, number: int, seed: int, models: Sequence[str], workspace: Workspace, config: CollectConfig
) -> int:
    """Makes and saves one scene, unless it is there; how many views it has, 0 if it fell apart."""
    path = out / f"scene_{number:05d}.npz"
    if path.exists():
        return count_views(path)
    rng = np.random.default_rng([seed, number])
    problem = make_scene(models, workspace, rng, config)
    if problem is None:
        return 0
    views, portraits = views_of(problem, workspace, rng, config)
    if views:
        save_scene(path, views, [o.model for o in problem.ordered()], portraits)
    return len(views)
