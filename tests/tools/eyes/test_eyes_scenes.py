"""What the eyes learn from: stretched objects that the physics takes, views cut and stored without loss, samples whose
labels lie where their inputs do."""

from dataclasses import replace

import numpy as np
import pytest

from tools.eyes.collect import (
    BACKGROUND,
    CollectConfig,
    SavedView,
    collect_scene,
    count_views,
    load_names,
    load_portraits,
    load_view,
    save_scene,
    scene_files,
)
from tools.eyes.looks import LookConfig, camera, pattern
from tools.eyes.samples import SQUARE_PX, SampleConfig, cut_label, draw_sample, mirrored
from tools.eyes.variants import make_variants, piece_corners, stretched
from torc.geometry.transforms import project
from torc.objects.library import builtin_object_names, load_object, load_stored, object_facts
from torc.objects.models import CollisionPiece
from torc.perception.embedded.inputs import CHANNELS, View, Window, cut
from torc.testing.synthetic import random_clutter, synthetic_capture
from torc.workspace.workspace_files import load_workspace

WORKSPACE = load_workspace()


@pytest.fixture(scope="module")
def saved():
    capture = synthetic_capture(random_clutter(np.random.default_rng(4), 9))
    o, label = capture.observation, capture.label_image
    rows, cols = slice(120, 360), slice(180, 540)
    K = o.K.copy()
    K[0, 2] -= cols.start
    K[1, 2] -= rows.start
    label = np.where(label < 0, BACKGROUND, label).astype(np.uint8)[rows, cols]
    depth = np.ascontiguousarray(o.depth_m[rows, cols])
    rgb = np.ascontiguousarray(o.rgb[rows, cols])
    return SavedView(rgb, depth, depth.copy(), label, K, o.T_world_camera, WORKSPACE.support_z_m)


@pytest.mark.parametrize("name", ["mug_red", "apple_red", "book_blue", "hammer_orange"])
def test_a_stretched_object_is_a_sound_object(name, tmp_path):
    names = [n for n in builtin_object_names() if n.startswith(name.split("_")[0])]
    model = load_object(names[0])
    other = stretched(model, "other", np.random.default_rng(1))
    ratio = np.array(other.size_m) / model.size_m
    assert (ratio > 0.6).all()
    assert (ratio < 1.5).all()
    assert len(other.pieces) == len(model.pieces)
    ways = np.random.default_rng(0).standard_normal((50, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    # The surface still agrees with the pieces.
    reach = np.concatenate([v.vertices for v in other.visuals]) @ ways.T
    assert np.abs(reach.max(axis=0) - other.support(ways)).max() < 0.012


def test_corners_span_each_kind_of_piece():
    ways = np.random.default_rng(0).standard_normal((200, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    turned = (0.8, 0.0, 0.6, 0.0)
    for kind, size in (
        ("box", (0.02, 0.03, 0.04)),
        ("cylinder", (0.03, 0.05)),
        ("sphere", (0.03,)),
        ("ellipsoid", (0.02, 0.03, 0.04)),
        ("capsule", (0.02, 0.05)),
    ):
        piece = CollisionPiece(kind, size, (0.01, -0.02, 0.03), turned)
        reach = (piece_corners(piece) @ ways.T).max(axis=0)
        short = piece.support(ways) - reach
        assert short.min() > -1e-9
        assert short.max() < 0.05 * max(size) + 1e-9


def test_variants_are_of_known_kinds_and_are_made_once(tmp_path, monkeypatch):
    few = tuple(n for n in builtin_object_names() if n.startswith(("mug_", "pear_")))
    monkeypatch.setattr("tools.eyes.variants.builtin_object_names", lambda: few)
    names = make_variants(tmp_path, 1, seed=3)
    kinds = {object_facts(n.removesuffix("_v0")).held_out for n in names}
    assert kinds == {False}
    stamps = {n: (tmp_path / n / "object.yaml").stat().st_mtime_ns for n in names}
    assert make_variants(tmp_path, 1, seed=3) == names
    assert stamps == {n: (tmp_path / n / "object.yaml").stat().st_mtime_ns for n in names}
    assert load_stored(tmp_path / names[0]).mass_kg > 0


def test_cameras_see_the_middle_of_the_scene():
    rng, middle = np.random.default_rng(0), np.array([0.65, -0.12, 1.08])
    for _ in range(50):
        mount = camera(WORKSPACE, middle, rng, LookConfig())
        x, y, z = (float(v[0]) for v in project(middle[None], mount.K, mount.T_world_camera))
        assert z > 0.3
        assert 0 < x < 640
        assert 0 < y < 480


def test_patterns_have_few_colours_and_many_forms():
    rng = np.random.default_rng(0)
    pictures = [pattern(64, 48, rng) for _ in range(20)]
    assert all(p.shape == (64, 48, 3) and p.dtype == np.uint8 for p in pictures)
    assert len({p.tobytes() for p in pictures}) == 20


def test_a_view_comes_back_as_it_was_stored(saved, tmp_path):
    portraits = np.arange(2 * 4 * 64 * 64 * 4, dtype=np.uint32).astype(np.uint8).reshape(2, 4, 64, 64, 4)
    save_scene(tmp_path / "scene_00003.npz", [saved, mirrored(saved)], ["mug_red", "pear_green"], portraits)
    (path,) = scene_files(tmp_path)
    assert count_views(path) == 2
    assert load_names(path) == ["mug_red", "pear_green"]
    assert np.array_equal(load_portraits(path), portraits)
    back = load_view(path, 0)
    for name in ("rgb", "label", "K", "T_world_camera"):
        assert np.array_equal(getattr(back, name), getattr(saved, name)), name
    inside = saved.depth_m < 6.5
    np.testing.assert_allclose(back.depth_m[inside], saved.depth_m[inside], atol=6e-5)


def test_a_mirrored_view_is_the_view_of_a_mirrored_world(saved):
    twice = mirrored(mirrored(saved))
    assert np.array_equal(twice.rgb, saved.rgb)
    np.testing.assert_allclose(twice.K, saved.K)
    a, b = (
        cut(View(v.rgb, v.depth_m, v.K, v.T_world_camera, v.support_z_m), Window(0, 0, 1.0), 240, 360)
        for v in (saved, mirrored(saved))
    )
    np.testing.assert_allclose(a.points[..., 1:], b.points[:, ::-1, 1:], atol=1e-4)


def test_labels_of_a_sample_lie_where_its_inputs_do(saved):
    """Where the label changes, so does the depth, in most places, whatever the scale and the mirror."""
    rng = np.random.default_rng(0)
    config = SampleConfig(stereo=0, noisy=0, colorless=0, gray=0, support_sigma_m=0, tilt_sigma_rad=0)
    for _ in range(6):
        sample = draw_sample(saved, rng, config)
        assert sample.inputs.shape == (CHANNELS, SQUARE_PX, SQUARE_PX)
        assert np.isfinite(sample.inputs).all()
        higher = sample.inputs[0] > 0.08
        there = sample.inputs[5] > 0
        objects = (sample.label >= 0) & there
        assert (higher[objects]).mean() > 0.85
        away = (sample.label < 0) & there & (np.abs(sample.inputs[1]) < 3)
        assert higher[away].mean() < 0.1


def test_cut_labels_are_nearest_neighbours(saved):
    label = cut_label(saved.label, Window(0, 0, 1.0), *saved.label.shape)
    assert np.array_equal(label, np.where(saved.label == BACKGROUND, -1, saved.label.astype(int)))
    half = cut_label(saved.label, Window(0, 0, 0.5), 120, 180)
    assert set(np.unique(half)) <= set(np.unique(label))
    assert (cut_label(saved.label, Window(-50, -50, 1.0), 40, 40) == -1).all()


@pytest.mark.long
def test_a_scene_depends_on_its_number_alone_and_is_made_once(tmp_path):
    names = [n for n in builtin_object_names() if n.startswith(("mug_", "apple_", "book_"))]
    config = replace(CollectConfig(), counts=((4, 1.0),), views=2, min_pixels=50)
    made = []
    for directory in (tmp_path / "a", tmp_path / "b"):
        directory.mkdir()
        made.append(collect_scene(directory, 5, 3, names, WORKSPACE, config))
    assert made == [2, 2]
    a, b = (load_view(tmp_path / d / "scene_00005.npz", 1) for d in ("a", "b"))
    assert np.array_equal(a.label, b.label)
    assert np.array_equal(a.stereo_m, b.stereo_m)
    portraits = load_portraits(tmp_path / "a" / "scene_00005.npz")
    assert portraits.shape[1:] == (4, 64, 64, 4)
    filled = portraits[..., 3].reshape(len(portraits) * 4, -1).mean(axis=1)
    assert (filled > 15).all()  # each shows something
    assert collect_scene(tmp_path / "a", 5, 3, names, WORKSPACE, config) == 2
