"""Imported objects get names and descriptions of their own."""

from dataclasses import replace
from pathlib import Path

import pytest
from mesh_files import SIZE, box

from torc.errors import InputError
from torc.io.digests import file_fingerprint
from torc.objects.importing import MeshImport
from torc.objects.importing.storing import (
    add_object,
    check_name,
    find_meshes,
    kept_names,
    unique_description,
)
from torc.objects.library import load_object, object_description
from torc.objects.object_files import load_source
from torc.objects.schema import ObjectSource


def _found(name: str, description: str = "the own die") -> MeshImport:
    model = replace(load_object("die_red"), name=name, description=description)
    return MeshImport(model, ObjectSource(file="die.stl", scale=0.001), ("a note",))


def test_an_object_is_stored_and_usable(object_store: Path) -> None:
    stored = add_object(_found("thing"), note="CC0")
    assert stored.model.description == "the own die"
    assert load_object("thing").name == "thing"
    assert load_source(object_store / "thing") == ObjectSource(file="die.stl", note="CC0", scale=0.001)


def test_descriptions_are_made_unique() -> None:
    assert unique_description("the red mug", "mine") == "the red mug"
    taken = object_description("mug_red")
    assert unique_description(taken, "mine") == f"{taken} 2"
    add_object(_found("mine", taken))
    assert object_description("mine") == f"{taken} 2"
    assert unique_description(taken, "another") == f"{taken} 3"
    add_object(_found("mine", f"{taken} 2"), overwrite=True)  # its own words are not in its way
    assert object_description("mine") == f"{taken} 2"


def test_taken_names_are_refused(object_store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="comes with torc"):
        check_name("mug_red", overwrite=True)
    add_object(_found("thing"))
    with pytest.raises(InputError, match="--overwrite"):
        add_object(_found("thing"))
    add_object(_found("thing"), overwrite=True)
    monkeypatch.setenv("TORC_OBJECTS", f"{tmp_path / 'first'}:{object_store}")
    with pytest.raises(InputError, match="already, in"):  # it would hide the other one
        check_name("thing", overwrite=True)


def _keep(library: Path, **made_of: Path) -> None:
    for name, path in made_of.items():
        source = ObjectSource(file=path.name, scale=0.001, sha256=file_fingerprint(path))
        add_object(replace(_found(name, f"the {name}"), source=source), library)


def test_files_are_known_whatever_they_are_called(object_store: Path, tmp_path: Path) -> None:
    cup, jug, new = (tmp_path / name for name in ("cup.stl", "jug.stl", "new.stl"))
    for path in (cup, jug, new):
        path.write_text(path.name)
    assert kept_names({cup: "cup"}, 0.001) == {}
    _keep(object_store, mug=cup, jug=jug)
    (object_store / "damaged").mkdir()
    (object_store / "damaged" / "object.yaml").write_text("broken")
    wanted = {cup: "cup", jug: "jug", new: "mug", tmp_path / "gone.stl": "gone"}
    assert kept_names(wanted, 0.001) == {cup: "mug", jug: "jug"}
    assert kept_names(wanted, 1.0) == {}
    assert kept_names(wanted, 0.001, tmp_path / "elsewhere") == {}


def test_meshes_are_found_once_with_distinct_names(tmp_path: Path) -> None:
    root = tmp_path / "meshes"
    for folder in ("003_box/google_16k", "004_box/google_16k"):
        (root / folder).mkdir(parents=True)
        box(SIZE).export(root / folder / "textured.obj")
        box(SIZE).export(root / folder / "textured.stl")
    box(SIZE).export(root / "Mug.STL")
    (root / "readme.txt").write_text("")
    found, left_out = find_meshes(root)
    names = sorted(name for _, name in found)
    assert names == [f"00{k}_box_google_16k_textured" for k in (3, 4)] + ["Mug"]
    assert {p.suffix for p, _ in found} == {".obj", ".STL"}
    assert [why.split(":")[0] for _, why in left_out] == ["textured.obj is taken"] * 2
