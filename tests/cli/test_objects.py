"""`torc objects` as a user meets it."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tests.helpers.torc_command import run_torc
from torc.cli import objects
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


@pytest.mark.long
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


def test_a_damaged_object_does_not_stop_the_list(object_store, capsys):
    (object_store / "thing").mkdir(parents=True)
    (object_store / "thing" / "object.yaml").write_text("broken")
    code, out, err = _torc("list", capsys=capsys)
    assert code == 0
    assert len(out.splitlines()) == len(builtin_object_names())
    assert "thing" in err
    assert _torc("show", "thing", capsys=capsys)[0] == 2


def test_a_sheet_of_a_kind_and_an_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "new" / "sheet.png"
    assert objects.SheetCommand(("die", "mug_red", "die_red"), path).run() == 0
    assert str(path) in capsys.readouterr().out
    with Image.open(path) as page:
        width, height = objects.CELL
        assert page.size == (objects.COLUMNS * width, height + objects.CAPTION)
        middles = [page.getpixel((k * width + width // 2, height // 2)) for k in range(objects.COLUMNS)]
        paper = (252, 252, 250)
        assert [m == paper for m in middles] == [False] * 4 + [True]  # three dice and a mug
