"""`torc problems import` as a user meets it."""

import json
from functools import partial

import pytest
from torc_command import run_torc

from tests.helpers.graspclutter6d_tree import upright, write_tree
from tests.helpers.plain_mesh_reader import read_plain_mesh
from torc.generation.graspclutter6d import placing

OBJECTS = (upright(17, 0.0, 0.0, 0.3), upright(48, 0.10, 0.05), upright(56, -0.10, 0.02, 1.0))


_import = partial(run_torc, "problems", "import")


@pytest.fixture
def root(tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "store"))
    monkeypatch.setattr(placing, "read_mesh", read_plain_mesh)
    write_tree(tmp_path / "gc6d", {249: OBJECTS}, images=15)
    return tmp_path / "gc6d"


def test_a_scene_becomes_a_problem_file(root, tmp_path, capsys):
    code, out, _ = _import(root, "--scene", 249, "--target", "48", "--out", tmp_path / "out", capsys=capsys)
    assert code == 0
    assert "the can of green beans" in out
    assert "1 of 1 problems" in out
    (file,) = (tmp_path / "out").iterdir()
    assert str(file) in out.replace("\n", "")
    code, out, _ = _import(root, "--scene", 249, "--target", "48", "--out", tmp_path / "out", capsys=capsys)
    assert code == 0
    assert f"there  scene 249, obj_000048_0: {file}" in out
    assert "1 of 1 problems" in out


def test_json_holds_what_was_made_and_what_was_not(root, tmp_path, capsys):
    arguments = (root, "--paper", "--scene", 249, "--scene", 251, "--out", tmp_path / "out", "--json")
    code, out, _ = _import(*arguments, capsys=capsys)
    rows = json.loads(out)
    assert code == 1
    assert [(r["scene"], r["target"], bool(r["file"])) for r in rows] == [
        (249, "obj_000017_0", True),
        (249, "obj_000048_0", True),
        (251, "obj_000046_0", False),
        (251, "obj_000049_0", False),
    ]
    assert "is missing" in rows[2]["reason"]
    assert rows[0]["category"] == "structured"
    assert 0.0 <= rows[0]["in_sight"] <= 1.0
