"""The laws that every object that comes with torc obeys."""

from collections import Counter

import numpy as np
import pytest

from torc.objects.files import read_entry
from torc.objects.library import (
    builtin_object_names,
    held_out_kinds,
    load_object,
    object_description,
    object_facts,
)
from torc.objects.models import pieces_bounds
from torc.objects.store import SHIPPED_OBJECTS

NAMES = builtin_object_names()
STEEL = ("spoon_steel",)
FILLER = {"the", "a", "of", "with", "and"}


def test_the_library_is_large_and_varied() -> None:
    kinds = Counter(object_facts(name).kind for name in NAMES)
    assert len(kinds) >= 60
    assert len(NAMES) >= 180
    assert min(kinds.values()) >= 3
    assert len(held_out_kinds()) == 9


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
