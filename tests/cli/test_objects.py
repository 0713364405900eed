"""`torc objects` as a user meets it."""

import json
import os
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from torc_command import run_torc

from torc.objects.files import load_source
from torc.objects.library import builtin_object_names, load_object

_torc = partial(run_torc, "objects")


def _write_box(path):
    """A box in millimetres."""
    trimesh.creation.box((60, 160, 210)).export(path)
    return path


def test_built_in_objects_are_listed_and_shown(capsys):
    code, out, _ = _torc("list", "--json", capsys=capsys)
    assert code == 0
    assert [row["name"] for row in json.loads(out)] == list(builtin_object_names())
    code, out, _ = _torc("list", "--kind", "mug", capsys=capsys)
    assert code == 0
    assert {line.split()[1] for line in out.splitlines()} == {"mug"}
    code, out, _ = _torc("list", "--own", capsys=capsys)
    assert "torc objects import" in out
    code, out, _ = _torc("show", "mug_red", "--json", capsys=capsys)
    facts = json.loads(out)
    assert facts["size_m"] == list(load_object("mug_red").size_m)
    assert not facts["own"]


def test_a_directory_is_imported_with_a_summary(tmp_path, object_store, capsys):
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    _write_box(meshes / "My Box.stl")
    (meshes / "broken.stl").write_bytes(b"nothing")
    code, out, err = _torc("import", meshes, "--scale", "0.001", "--friction", "0.6", capsys=capsys)
    assert code == 1
    assert err == ""
    assert "[1/2] My Box.stl: my_box, the my box: 60 x 160 x 210 mm, 1.714 kg, 1 convex pieces" in out
    assert "[2/2] broken.stl: refused: " in out
    assert f"1 imported, 1 refused, into {object_store}" in out
    assert load_object("my_box").friction == 0.6
    code, out, _ = _torc("import", meshes, "--scale", "0.001", capsys=capsys)
    assert code == 1
    assert "[1/2] My Box.stl: my_box is there already (--overwrite" in out
    assert "0 imported, 1 there already, 1 refused" in out
    code, out, _ = _torc("import", meshes, "--scale", "0.002", capsys=capsys)
    assert "[1/2] My Box.stl: refused: There is an object 'my_box' already" in out
    (meshes / "broken.stl").unlink()
    assert _torc("import", meshes, "--scale", "0.001", capsys=capsys)[0] == 0
    whole = (meshes / "My Box.stl").read_bytes()
    (meshes / "My Box.stl").write_bytes(whole[:-1] + b"\1")  # another file of the same name
    code, out, _ = _torc("import", meshes, "--scale", "0.001", capsys=capsys)
    assert "[1/1] My Box.stl: refused: There is an object 'my_box' already" in out

    code, out, _ = _torc("list", "--own", "--json", capsys=capsys)
    assert [row["name"] for row in json.loads(out)] == ["my_box"]
    picture = tmp_path / "box.png"
    code, out, _ = _torc("show", "my_box", "--picture", picture, capsys=capsys)
    assert code == 0
    assert "My Box.stl (scale 0.001)" in out
    with Image.open(picture) as image:
        assert np.array(image).std() > 5

    code, out, _ = _torc("import", meshes / "My Box.stl", "--scale", "0.001", "--json", capsys=capsys)
    assert code == 1
    assert "--overwrite" in json.loads(out)[0]["refused"]


def test_of_two_meshes_with_one_name_neither_is_lost_unsaid(tmp_path, object_store, capsys):
    for directory in ("a", "b"):
        (tmp_path / directory).mkdir()
        _write_box(tmp_path / directory / "textured.stl")
    both = tmp_path / "a", tmp_path / "b", "--scale", "0.001"
    for more in ([], ["--overwrite"]):
        code, out, _ = _torc("import", *both, *more, capsys=capsys)
        assert code == 1
        assert f"[2/2] textured.stl: refused: 'textured' is {tmp_path / 'a' / 'textured.stl'} in this" in out


def test_a_file_is_known_by_whatever_name_it_was_imported(tmp_path, object_store, capsys):
    first = tmp_path / "meshes" / "a" / "cup.stl"
    other = tmp_path / "meshes" / "b" / "cup.stl"
    for path in (first, other):
        path.parent.mkdir(parents=True)
    _write_box(first)
    again = "import", tmp_path / "meshes", "--scale", "0.001"
    assert _torc(*again, capsys=capsys)[0] == 0
    # Files of one name get their directories' names.
    _write_box(other).write_bytes(first.read_bytes()[:-1] + b"\1")
    code, out, _ = _torc(*again, capsys=capsys)
    assert code == 0
    assert "[1/2] cup.stl: cup is there already (--overwrite imports it again, as a_cup)" in out
    assert "[2/2] cup.stl: b_cup, the b cup:" in out
    assert "1 imported, 1 there already, 0 refused" in out
    code, out, _ = _torc(*again, "--json", capsys=capsys)
    assert [row["there"] for row in json.loads(out)] == ["cup", "b_cup"]
    shutil.move(first, tmp_path / "meshes" / "b" / "jug.stl")
    code, out, _ = _torc(*again, "--json", capsys=capsys)
    assert [row["there"] for row in json.loads(out)] == ["b_cup", "cup"]
    other.unlink()
    _torc(*again, "--name", "mine", capsys=capsys)  # asked for by that name
    assert sorted(p.name for p in object_store.iterdir()) == ["b_cup", "cup", "mine"]


def test_odd_names_and_links_stop_nothing(tmp_path, object_store, capsys):
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    _write_box(meshes / os.fsdecode(b"caf\xe9\x1b[2J.stl"))
    (meshes / "---.stl").write_bytes(b"")  # nothing that a name could be made of
    (meshes / "loop.stl").symlink_to("loop.stl")
    (meshes / "out.stl").symlink_to(_write_box(tmp_path / "elsewhere.stl"))
    code, out, err = _torc("import", meshes, "--scale", "0.001", "--json", capsys=capsys)
    rows = {Path(row["file"]).name: row for row in json.loads(out)}
    assert code == 1
    assert "No name can be made" in rows["---.stl"]["refused"]
    assert "no mesh file" in rows["loop.stl"]["refused"]
    assert "leads out of the directory" in rows["out.stl"]["left_out"]
    assert [p.name for p in object_store.iterdir()] == ["caf_2j"]
    assert load_source(object_store / "caf_2j").file == "caf__[2J.stl"
    assert "\x1b" not in err


def test_a_library_elsewhere_is_told(tmp_path, capsys):
    _write_box(tmp_path / "a.stl")
    arguments = ["--scale", "0.001", "--name", "b", "--mass", "0.5", "--description", "the tall parcel"]
    code, out, _ = _torc(
        "import", tmp_path / "a.stl", *arguments, "--library", tmp_path / "lib", capsys=capsys
    )
    assert code == 0
    assert f"export TORC_OBJECTS={tmp_path / 'lib'}" in out
    assert "b, the tall parcel" in out
    (tmp_path / "b.stl").write_bytes(b"nothing")
    code, out, _ = _torc("import", tmp_path / "b.stl", "--library", tmp_path / "lib", capsys=capsys)
    assert code == 1
    assert "0 imported, 1 refused" in out
    assert "TORC_OBJECTS" not in out


def test_a_damaged_object_does_not_stop_the_list(object_store, capsys):
    (object_store / "thing").mkdir(parents=True)
    (object_store / "thing" / "object.yaml").write_text("broken")
    code, out, err = _torc("list", capsys=capsys)
    assert code == 0
    assert len(out.splitlines()) == len(builtin_object_names())
    assert "thing" in err
    assert _torc("show", "thing", capsys=capsys)[0] == 2
