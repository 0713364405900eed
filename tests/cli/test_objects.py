"""`torc objects` as a user meets it."""

import json
import os
import shutil
import struct
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from torc_command import run_torc

from torc.objects.files import load_source
from torc.objects.library import builtin_object_names, load_object

CORNERS = np.array([(x, y, z) for x in (-30, 30) for y in (-80, 80) for z in (-105, 105)], dtype=float)
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
FACES += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]


_torc = partial(run_torc, "objects")


def _write_box(path):
    """A box in millimetres."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[list(f)].ravel().tolist(), 0) for f in FACES)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(FACES)) + body)
    return path


@pytest.mark.parametrize("command", [[], ["list"], ["show"], ["import"]])
def test_every_command_has_help(command, capsys):
    code, out, _ = _torc(*command, "--help", capsys=capsys)
    assert code == 0
    assert "usage: torc objects" in out


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


def test_overwriting_replaces_nothing_but_objects(tmp_path, object_store, capsys):
    mesh = _write_box(tmp_path / "mug.stl")
    (object_store / "mug").mkdir(parents=True)
    thesis = object_store / "mug" / "thesis.txt"
    thesis.write_text("years of work")
    for _ in range(2):
        code, out, _ = _torc("import", mesh, "--scale", "0.001", "--overwrite", capsys=capsys)
        assert code == 1
        assert "mug is no object, or holds other files besides" in out
        assert thesis.read_text() == "years of work"
        thesis.rename(object_store / "kept.txt")
        assert _torc("import", mesh, "--scale", "0.001", "--overwrite", capsys=capsys)[0] == 0
        (object_store / "kept.txt").rename(thesis)  # now beside an object


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


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["import"], "Give mesh files"),
        (["import", "nowhere.stl"], "no file or directory nowhere.stl"),
        (["import", "EMPTY"], "no OBJ, GLB, STL or PLY file"),
        (["import", "MESH", "MESH", "--name", "a"], "--name is for one mesh"),
        (["import", "MESH", "--scale", "0"], "scale must be between"),
        (["import", "MESH", "--library", "/proc/no"], "Objects cannot be kept in /proc/no"),
        (["import", "MESH", "--mass", "-1"], "mass must be between"),
        (["import", "MESH", "--name", "../a"], "cannot be a name"),
        (["import", "MESH", "--description", "the\nmug"], "A description is a line"),
        (["import", "MESH", "--description", "x" * 121], "A description is a line"),
        (["show", "mug_rad"], "Did you mean 'mug_red'"),
        (["list", "--kind", "mog"], "Did you mean 'mug'"),
        (["show", "mug_red", "--picture", "/proc/no.png"], "Cannot write the picture"),
        (
            ["show", "mug_red", "--picture", "x.gif"],
            "x.gif: pictures are written as .png. Use a name that ends so",
        ),
        (["show", "mug_red", "--picture", "x"], "x: pictures are written as .png"),
    ],
)
def test_wrong_arguments_get_one_clear_line(arguments, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    places = {"EMPTY": tmp_path / "empty", "MESH": _write_box(tmp_path / "a.stl")}
    code, _, err = _torc(*(places.get(a, a) for a in arguments), capsys=capsys)
    assert code == 2
    assert told in err
    assert "Traceback" not in err
