"""The laws that every object that comes with torc obeys."""

import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from torc.errors import UnknownNameError
from torc.objects.files import read_entry
from torc.objects.library import (
    builtin_object_names,
    held_out_kinds,
    kind_names,
    load_object,
    object_description,
    object_facts,
)
from torc.objects.models import ObjectModel, pieces_bounds
from torc.objects.store import SHIPPED_OBJECTS

NAMES = builtin_object_names()
HANDLED = ("mug", "teacup", "saucepan", "frying_pan")
"""Hollow kinds with a handle on their right side (-y), which shifts their middle."""
OPEN = (*HANDLED, "bowl", "tumbler", "flower_pot", "plate", "baking_dish", "basket")
LYING = {"toothpaste_tube", "marker", "banana", "lemon", "notebook", "toy_animal"}
"""Kinds that lie, or whose body does; their textures run along them."""
STEEL = ("spoon_steel",)
FILLER = {"the", "a", "of", "with", "and"}


def _names(*kinds: str) -> list[str]:
    return [name for name in NAMES if object_facts(name).kind in kinds]


def test_the_library_is_large_and_varied() -> None:
    assert len(kind_names()) >= 60
    assert len(NAMES) >= 180
    assert min(Counter(object_facts(name).kind for name in NAMES).values()) >= 3
    assert len(held_out_kinds()) == 9


def test_the_index_tells_what_the_files_do() -> None:
    assert sorted(NAMES) == sorted(file.parent.name for file in SHIPPED_OBJECTS.glob("*/object.yaml"))
    for facts in map(object_facts, NAMES):
        entry = read_entry(SHIPPED_OBJECTS / facts.name)
        for field in ("name", "kind", "description", "mass_kg", "held_out"):
            assert getattr(facts, field) == getattr(entry, field)


def test_a_kind_is_held_out_as_a_whole_and_stands_together() -> None:
    """Samples of a seed follow from the order of the kinds."""
    facts = [object_facts(name) for name in NAMES]
    kinds = [(f.kind, f.held_out) for f in facts]
    assert [kind for kind, last in zip(kinds, [None, *kinds]) if kind != last] == [
        (kind, kind in held_out_kinds()) for kind in kind_names()
    ]


def test_names_and_descriptions_are_unique() -> None:
    assert len(set(NAMES)) == len(NAMES)
    descriptions = [object_description(n) for n in NAMES]
    assert len(set(descriptions)) == len(descriptions)
    assert all(len(d.split()) <= 7 for d in descriptions)
    assert all(d.startswith("the ") for d in descriptions)


def test_no_description_fits_another_object_too() -> None:
    """Whoever is told "the red mug" must not find two: no description may hold all words of another one."""
    words = {n: frozenset(object_description(n).split()) - FILLER for n in NAMES}
    ends = Counter(object_description(n).split()[-1] for n in NAMES)
    ambiguous = []
    for a in NAMES:
        last = object_description(a).split()[-1]
        if len(words[a]) == 1 and ends[last] == 1:
            continue  # "the orange": nothing else is one, though other things are orange
        ambiguous += [(a, b) for b in NAMES if a != b and words[a] <= words[b]]
    assert ambiguous == []


def test_names_need_neither_pillow_nor_numpy() -> None:
    code = (
        "import sys; from torc.objects.library import kind_names, object_facts, object_names;"
        "object_facts(object_names()[0]), kind_names();"
        "sys.exit(int(bool({'numpy', 'PIL', 'scipy', 'yaml'} & set(sys.modules))))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_unknown_name_suggests_a_near_one() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'mug_red'"):
        load_object("mug_rad")


def test_most_objects_fit_the_gripper() -> None:
    graspable = [min(load_object(n).size_m) <= 0.075 for n in NAMES]
    assert np.mean(graspable) >= 0.85


@pytest.mark.parametrize("name", NAMES)
def test_frame_size_and_mass(name: str) -> None:
    model = load_object(name)
    lower, upper = pieces_bounds(model.pieces)
    np.testing.assert_allclose(lower + upper, 0.0, atol=1e-9)
    np.testing.assert_allclose(upper - lower, model.size_m, atol=1e-9)
    volume = sum(p.volume_m3 for p in model.pieces)
    assert 30 < model.mass_kg / volume < (8000 if name in STEEL else 3000)
    assert sum(model.piece_masses_kg) == pytest.approx(model.mass_kg)
    assert min(model.size_m) > 0.007
    assert max(model.size_m) < 0.30


@pytest.mark.parametrize("name", NAMES)
def test_meshes_of_contact_pieces_are_convex_and_solid(name: str) -> None:
    from scipy.spatial import ConvexHull

    for piece in load_object(name).pieces:
        if piece.kind == "mesh":
            hull = ConvexHull(piece.mesh_vertices)
            to_planes = piece.mesh_vertices @ hull.equations[:, :3].T + hull.equations[:, 3]
            # a vertex deep inside the hull would mean that the shape was not convex
            assert to_planes.max(axis=1).min() > -0.0012
            assert hull.volume > 1e-8


@pytest.mark.parametrize("name", NAMES)
def test_visual_meshes_are_well_formed(name: str) -> None:
    model = load_object(name)
    for mesh in model.visuals:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices)
        assert (mesh.uv is None) == (mesh.texture is None)
        assert mesh.normals is not None
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
        if mesh.texture is not None and mesh.uv is not None:
            assert max(mesh.texture.shape) <= 512
            assert mesh.uv.min() >= 0
            assert mesh.uv.max() <= 1


@pytest.mark.parametrize("name", NAMES)
def test_triangles_face_outwards_and_normals_agree(name: str) -> None:
    for mesh in load_object(name).visuals:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        face_normals = np.cross(b - a, c - a)
        assert mesh.normals is not None
        vertex_normals = mesh.normals[mesh.faces].mean(axis=1)
        large = np.linalg.norm(face_normals, axis=1) > 1e-9
        assert large.mean() > 0.9
        assert ((face_normals * vertex_normals).sum(axis=1)[large] > 0).all()


@pytest.mark.parametrize("name", NAMES)
def test_textures_are_not_mirrored(name: str) -> None:
    """Seen from outside, u runs to the right and v down: a triangle turns the other way round in the texture."""
    for mesh in load_object(name).visuals:
        if mesh.uv is None:
            continue
        p, q, r = (mesh.uv[mesh.faces[:, k]] for k in range(3))
        doubled = (q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0]
        # caps of lofted shapes carry one colour: their texture triangles are degenerate
        assert (doubled <= 1e-9).all()
        assert doubled.sum() < -0.4


@pytest.mark.parametrize("name", _names(*sorted(set(kind_names()) - LYING)))
def test_upright_labels_have_their_top_at_the_top(name: str) -> None:
    for mesh in load_object(name).visuals:
        if mesh.uv is None or mesh.normals is None:
            continue
        a, b, c = (mesh.faces[:, k] for k in range(3))
        upright = np.abs(mesh.normals[mesh.faces].mean(axis=1)[:, 2]) < 0.3
        for i, j in ((a, b), (b, c), (c, a)):
            dv, dz = (mesh.uv[j] - mesh.uv[i])[:, 1], (mesh.vertices[j] - mesh.vertices[i])[:, 2]
            assert (dv * dz)[upright].max(initial=0.0) < 1e-9


@pytest.mark.parametrize("name", _names(*OPEN))
def test_open_things_are_hollow_with_a_floor(name: str) -> None:
    model = load_object(name)
    z = np.linspace(0.009, 1.2 * model.size_m[2], 21) - model.size_m[2] / 2
    on_axis = np.stack([0 * z, 0 * z + _axis_y(model), z], axis=1)
    assert not _inside(model, on_axis).any()
    floor = on_axis[:1] * [1, 1, 0] - [0, 0, model.size_m[2] / 2 - 0.001]
    assert _inside(model, floor).all()


@pytest.mark.parametrize("name", _names(*OPEN))
def test_a_rim_has_room_for_a_finger_on_both_sides(name: str) -> None:
    """From the middle outwards, just below the rim: air enough for a finger, a thin wall, air again."""
    model = load_object(name)
    x = np.arange(0.0, model.size_m[0] / 2 + 0.03, 0.0005)
    rim = max(p.bounds[1, 2] for p in model.pieces if p.bounds[1, 0] > model.size_m[0] / 2 - 0.004)
    ray = np.stack([x, np.full_like(x, _axis_y(model)), np.full_like(x, rim - 0.002)], axis=1)
    wall = x[_inside(model, ray)]
    assert wall.min() > 0.024
    assert np.ptp(wall) < 0.011


@pytest.mark.parametrize("name", _names("tape_roll"))
def test_tape_rolls_have_a_hole(name: str) -> None:
    model = load_object(name)
    z = model.size_m[2] * np.linspace(-0.6, 0.6, 21)
    assert not _inside(model, np.stack([0 * z, 0 * z, z], axis=1)).any()
    assert _inside(model, np.array([[model.size_m[0] / 2 - 0.004, 0.0, 0.0]])).all()


def _axis_y(model: ObjectModel) -> float:
    """y of the vessel's axis: a mug's frame is shifted by its handle."""
    return (model.size_m[1] - model.size_m[0]) / 2 if model.kind in HANDLED else 0.0


def _inside(model: ObjectModel, points: np.ndarray) -> np.ndarray:
    return np.any([p.contains(points) for p in model.pieces], axis=0)
