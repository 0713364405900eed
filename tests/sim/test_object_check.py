"""Imported objects behave in the physics as built-in ones do."""

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from torc.objects.importing import MeshOptions, read_mesh
from torc.objects.library import load_object
from torc.objects.models import CollisionPiece, ObjectModel
from torc.sim.object_check import check_object, world_with
from torc.sim.settling import run


@pytest.fixture
def twins(tmp_path: Path) -> tuple[ObjectModel, ObjectModel]:
    """A built-in box, and the same box imported from an STL file in millimetres."""
    built_in = load_object("cracker_box_red")
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * built_in.size_m * 500
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[list(f)].ravel().tolist(), 0) for f in faces)
    (tmp_path / "box.stl").write_bytes(b"\0" * 80 + struct.pack("<I", len(faces)) + body)
    options = MeshOptions(scale=0.001, mass_kg=built_in.mass_kg, friction=built_in.friction)
    return built_in, read_mesh(tmp_path / "box.stl", options).model


def test_an_imported_box_is_the_built_in_box(twins: tuple[ObjectModel, ObjectModel]) -> None:
    built_in, imported = (world_with(model) for model in twins)
    for field in ("body_mass", "body_inertia", "body_ipos"):
        ours, theirs = (getattr(w.model, field)[w.object_bodies[0]] for w in (built_in, imported))
        np.testing.assert_allclose(theirs, ours, rtol=1e-4, atol=1e-7)
    run(built_in, 1.0)
    run(imported, 1.0)
    np.testing.assert_allclose(imported.positions, built_in.positions, atol=2e-4)
    assert check_object(twins[1]).stands


def test_a_tilted_imported_box_falls_as_the_built_in_one(twins: tuple[ObjectModel, ObjectModel]) -> None:
    ends = []
    for model in twins:
        world = world_with(model)
        tilt = 0.35  # beyond its balance about the narrow side
        world.set_object_pose(
            0, world.positions[0] + (0, 0, 0.02), np.array([np.cos(tilt / 2), 0, np.sin(tilt / 2), 0])
        )
        run(world, 1.5)
        ends.append((world.positions[0], np.abs(world.wxyz[0])))
    np.testing.assert_allclose(ends[1][0], ends[0][0], atol=0.005)
    np.testing.assert_allclose(ends[1][1], ends[0][1], atol=0.02)
    assert ends[0][0][2] < world_with(twins[0]).positions[0][2] - 0.05


@pytest.mark.parametrize("name", ["mug_red", "banana_yellow", "soup_can_red"])
def test_built_in_objects_stand(name: str) -> None:
    assert check_object(load_object(name)).stands


def test_what_leans_out_too_far_does_not_stand() -> None:
    pole = CollisionPiece("box", (0.01, 0.01, 0.1))
    arm = CollisionPiece("box", (0.04, 0.01, 0.01), (0.05, 0.0, 0.09))
    model = replace(load_object("die_red"), pieces=(pole, arm), size_m=(0.1, 0.02, 0.2))
    assert not check_object(model).stands
