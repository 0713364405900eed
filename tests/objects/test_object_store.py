"""One's own objects: where they are looked for, and that they never take the place of the built-in ones."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from torc.errors import InputError, UnknownNameError
from torc.objects.files import save_object
from torc.objects.library import (
    builtin_object_names,
    find_stored,
    has_object,
    load_object,
    object_description,
    object_facts,
    object_names,
    store_directories,
)
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement, Problem, load_problem, save_problem


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
