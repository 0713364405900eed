"""The laws that every object that comes with torc obeys."""

import os
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tools.grasp_model.facts import model_digest, save_facts
from torc.errors import InputError, UnknownNameError
from torc.objects.library import (
    SHIPPED_OBJECTS,
    GraspFact,
    builtin_object_names,
    find_stored,
    has_object,
    load_object,
    object_description,
    object_facts,
    object_names,
    read_facts,
    store_directories,
)
from torc.objects.models import ObjectModel, pieces_bounds
from torc.objects.object_files import read_entry, save_object
from torc.problems.problem import ObjectPlacement, Problem, load_problem, save_problem

NAMES = builtin_object_names()
STEEL = ("spoon_steel",)
FILLER = {"the", "a", "of", "with", "and"}


def test_the_library_is_large_and_varied() -> None:
    kinds = Counter(object_facts(name).kind for name in NAMES)
    assert len(kinds) >= 60
    assert len(NAMES) >= 180
    assert min(kinds.values()) >= 3


def test_the_index_tells_what_the_files_do() -> None:
    assert sorted(NAMES) == sorted(file.parent.name for file in SHIPPED_OBJECTS.glob("*/object.yaml"))
    for facts in map(object_facts, NAMES):
        entry = read_entry(SHIPPED_OBJECTS / facts.name)
        for field in ("name", "kind", "description", "mass_kg", "held_out"):
            assert getattr(facts, field) == getattr(entry, field)


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
def test_triangles_face_outwards_and_normals_agree(name: str) -> None:
    for mesh in load_object(name).visuals:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        face_normals = np.cross(b - a, c - a)
        assert mesh.normals is not None
        vertex_normals = mesh.normals[mesh.faces].mean(axis=1)
        large = np.linalg.norm(face_normals, axis=1) > 1e-9
        assert large.mean() > 0.9
        assert ((face_normals * vertex_normals).sum(axis=1)[large] > 0).all()


def test_every_model_was_measured_as_it_is_now() -> None:
    """If this fails, a model has changed: python -m tools.grasp_model graspable"""
    facts = read_facts()
    assert tuple(facts) == NAMES
    stale = [name for name in NAMES if facts[name].digest != model_digest(load_object(name))]
    assert stale == []


def test_facts_survive_the_disk(tmp_path: Path) -> None:
    facts = {"a": GraspFact(1.0, 0.333, "00ff"), "b": GraspFact(0.0, 0.0, "1234")}
    save_facts(facts, tmp_path / "facts.json")
    assert read_facts(tmp_path / "facts.json") == facts


def test_a_digest_changes_with_what_decides_a_grasp_only() -> None:
    model = load_object("mug_red")
    digest = model_digest(model)
    assert digest == model_digest(replace(model, visuals=(), description="another"))
    assert digest != model_digest(replace(model, mass_kg=0.1))
    assert digest != model_digest(replace(model, friction=0.1))
    assert digest != model_digest(replace(model, pieces=model.pieces[1:]))


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> dict[str, ObjectModel]:
    """All objects of the catalogue, drawn now, in its order."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    from tools.objects.catalogue import ALL_KINDS
    from tools.objects.drawing import draw

    return {variant.name: draw(kind, variant) for kind in ALL_KINDS for variant in kind.variants}


def test_the_drawing_code_draws_what_is_shipped(drawn: dict[str, ObjectModel]) -> None:
    """Up to the last bits, which depend on the processor, and the pixels of letters, which depend on Pillow."""
    assert tuple(drawn) == NAMES
    for name, new in drawn.items():
        shipped = load_object(name)
        for field in ("kind", "description", "mass_kg", "rolls", "friction", "held_out"):
            assert getattr(new, field) == getattr(shipped, field)
        assert [p.kind for p in new.pieces] == [p.kind for p in shipped.pieces]
        for p, q in zip(new.pieces, shipped.pieces):
            numbers = [[*r.size, *r.position, *r.wxyz, r.relative_density] for r in (p, q)]
            np.testing.assert_allclose(*numbers, atol=1e-9)
            if p.vertices is not None:
                np.testing.assert_allclose(p.vertices, q.mesh_vertices, atol=1e-9)
        assert len(new.visuals) == len(shipped.visuals)
        for v, w in zip(new.visuals, shipped.visuals):
            np.testing.assert_allclose(v.vertices, w.vertices, atol=1e-9)
            np.testing.assert_array_equal(v.faces, w.faces)
            np.testing.assert_allclose(v.rgba, w.rgba, atol=1e-9)
            assert np.shape(v.texture) == np.shape(w.texture)


def _own(name: str, **changes: object) -> ObjectModel:
    return replace(load_object("die_red"), name=name, kind="own", held_out=True, **changes)  # type: ignore[arg-type]


def test_the_environment_says_where_objects_live(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TORC_OBJECTS", f"{tmp_path}/a{os.pathsep}{os.pathsep}{tmp_path}/b")
    assert store_directories() == (tmp_path / "a", tmp_path / "b")
    monkeypatch.setenv("TORC_OBJECTS", "")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert store_directories() == (tmp_path / "torc" / "objects",)
    monkeypatch.setenv("XDG_DATA_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert store_directories() == (tmp_path / ".local" / "share" / "torc" / "objects",)


def test_stored_objects_are_found_and_loaded(object_store: Path) -> None:
    assert object_names() == builtin_object_names()
    save_object(_own("thing"), object_store / "thing")
    assert object_names() == (*builtin_object_names(), "thing")
    assert has_object("thing")
    assert load_object("thing").kind == "own"
    assert load_object("thing") is load_object("thing")
    assert object_description("thing") == load_object("die_red").description
    assert not object_facts("thing").builtin


def test_a_stored_object_does_not_shadow_a_built_in_one(object_store: Path) -> None:
    save_object(replace(_own("mug_red")), object_store / "mug_red")
    assert load_object("mug_red").kind == "mug"
    assert object_names() == builtin_object_names()


@pytest.mark.parametrize("name", ["../thing", "/etc", "..", "a\0b", "x" * 65])
def test_no_name_leads_out_of_the_store(object_store: Path, name: str) -> None:
    save_object(_own("thing"), object_store / "inner" / "thing")
    save_object(_own("thing"), object_store / "thing")
    assert find_stored(name) is None
    assert not has_object(name)
    with pytest.raises(UnknownNameError):
        load_object(name)


def test_problems_name_stored_objects(
    object_store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_object(_own("thing"), object_store / "thing")
    placement = ObjectPlacement("it", "thing", (0.6, 0.0, 1.1), (1.0, 0.0, 0.0, 0.0))
    problem = Problem("p", "structured", "", "it", (placement,))
    save_problem(problem, tmp_path / "p.yaml")
    assert load_problem(tmp_path / "p.yaml") == problem
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "elsewhere"))
    with pytest.raises(
        InputError, match=r"no object model 'thing' on this machine.*torc objects import MESH --name thing"
    ):
        load_problem(tmp_path / "p.yaml")
