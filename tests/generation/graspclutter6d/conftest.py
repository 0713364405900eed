"""Meshes that are read at once."""

import pytest

from tests.helpers.plain_mesh_reader import read_plain_mesh
from torc.generation.graspclutter6d import placing


@pytest.fixture(autouse=True)
def instant_meshes(tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "store"))
    monkeypatch.setattr(placing, "read_mesh", read_plain_mesh)
