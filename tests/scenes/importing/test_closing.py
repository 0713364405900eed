"""The solid behind a surface is found whatever way round its triangles are, and where small things are missing."""

import numpy as np
import pytest
from mesh_files import MUG, box, revolved

from torc.scenes.importing.closing import closed_net, is_closed, parts, signed_volume

SIZE = (0.06, 0.16, 0.21)
VOLUME = float(np.prod(SIZE))


def test_a_box_is_closed_and_its_volume_exact() -> None:
    vertices, faces = box(SIZE)
    net = closed_net(vertices, faces)
    assert (net.closed, net.turned, net.closed_holes) == (True, False, 0)
    assert signed_volume(net.vertices, net.faces) == pytest.approx(VOLUME)


def test_an_inside_out_box_is_turned() -> None:
    vertices, faces = box(SIZE)
    net = closed_net(vertices, faces[:, ::-1])
    assert net.turned
    assert signed_volume(net.vertices, net.faces) == pytest.approx(VOLUME)


@pytest.mark.parametrize("seed", range(5))
def test_mixed_orientations_are_made_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = revolved(MUG)
    mixed = np.where(rng.random(len(faces))[:, None] < 0.4, faces[:, ::-1], faces)
    net = closed_net(vertices, mixed)
    assert net.closed
    assert signed_volume(net.vertices, net.faces) == pytest.approx(signed_volume(vertices, faces))


def test_parts_of_mixed_orientation_all_face_outwards() -> None:
    vertices, faces = box(SIZE)
    both = np.concatenate([vertices, vertices + 1.0])
    mixed = np.concatenate([faces, faces[:, ::-1] + 8])
    mixed[0] = mixed[0, ::-1]
    net = closed_net(both, mixed)
    assert net.closed
    volumes = [signed_volume(both, part) for part in parts(len(both), net.faces)]
    np.testing.assert_allclose(volumes, VOLUME)


def test_a_missing_underside_is_closed_a_missing_top_is_not() -> None:
    vertices, faces = box(SIZE)
    net = closed_net(vertices, np.delete(faces, (8, 9), axis=0))
    assert (net.closed, net.closed_holes) == (True, 1)
    assert signed_volume(net.vertices, net.faces) == pytest.approx(VOLUME)
    assert not closed_net(vertices, faces[:-2]).closed


def test_a_small_hole_is_closed() -> None:
    angles = np.linspace(-1.4, 1.4, 15)
    vertices, faces = revolved(
        [(0.0, -0.04), *zip(0.04 * np.cos(angles), 0.04 * np.sin(angles)), (0.0, 0.04)]
    )
    net = closed_net(vertices, np.delete(faces, 300, axis=0))
    assert (net.closed, net.closed_holes) == (True, 1)
    assert signed_volume(net.vertices, net.faces) == pytest.approx(signed_volume(vertices, faces), rel=1e-3)


def test_an_edge_of_three_triangles_is_not_closed() -> None:
    _, faces = box(SIZE)
    assert not is_closed(np.concatenate([faces, [[0, 1, 7]]]))


def test_parts_come_by_size() -> None:
    _, faces = box(SIZE)
    found = parts(16, np.concatenate([faces[:2], faces + 8]))
    assert [len(p) for p in found] == [12, 2]
