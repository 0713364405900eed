"""The surfaces of a GLB file."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, Int

from torc.errors import InputError
from torc.scenes.importing.reading.gltf.glb import Corners, Glb, GlbError, entry
from torc.scenes.importing.reading.gltf.looks import GltfLooks
from torc.scenes.importing.reading.gltf.nodes import placed_nodes
from torc.scenes.importing.reading.gltf.schema import Primitive
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import Surface

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def read_glb(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surfaces of the scene that a GLB file shows. See `SurfaceReader`."""
    glb = Glb(data, reading.path)
    looks = None if reading.neighbours is None else GltfLooks(glb, reading)
    drawn: dict[int, list[Primitive]] = {}  # of each mesh; many nodes may show the same
    try:
        for node, T_scene_node in placed_nodes(glb.gltf, reading):
            if node.mesh is None:
                continue
            mesh = entry(glb.gltf.meshes, node.mesh, "meshes")
            if node.mesh not in drawn:  # the rest are points and lines
                drawn[node.mesh] = [p for p in mesh.primitives if p.mode in (_TRIANGLES, _STRIP, _FAN)]
            weights = mesh.weights if node.weights is None else node.weights
            for primitive in drawn[node.mesh]:
                yield _surface(glb, primitive, weights, T_scene_node, looks)
    except GlbError as error:
        raise InputError(f"{reading.path} is not a readable GLB file: {error}.") from None


def _surface(
    glb: Glb,
    primitive: Primitive,
    weights: Sequence[float],
    T_scene_node: Float[np.ndarray, "4 4"],
    looks: GltfLooks | None,
) -> Surface:
    glb.check_plain(primitive)
    if "POSITION" not in primitive.attributes:
        raise GlbError("a part has no POSITION")
    count = glb.count(primitive.attributes["POSITION"])
    faces, corners = _faces(glb, primitive, count), Corners(count)
    if primitive.indices is not None:
        faces, corners = _compact(faces, count)
    # Triangles that are not finite are left out later, and told.
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = _positions(glb, primitive, corners, weights)
        vertices = vertices @ T_scene_node[:3, :3].T + T_scene_node[:3, 3]
    a, b, c = T_scene_node[:3, :3]
    if a @ np.cross(b, c) < 0:  # it mirrors
        faces = faces[:, ::-1]
    surface = Surface(vertices, faces)
    return surface if looks is None or not len(faces) else looks.dressed(surface, primitive, corners)


def _compact(faces: Int[np.ndarray, "m 3"], count: int) -> tuple[Int[np.ndarray, "m 3"], Corners]:
    """The triangles on those corners alone that they use; in many files parts share one table of corners."""
    used, places = np.unique(faces, return_inverse=True)
    return places.reshape(-1, 3), Corners(count, used)


def _positions(
    glb: Glb, primitive: Primitive, corners: Corners, weights: Sequence[float]
) -> Float[np.ndarray, "n 3"]:
    """The corners, with the morph targets that are on by default (glTF 2.0, section 3.7.2.2)."""
    vertices = glb.values(primitive.attributes["POSITION"], ("VEC3",), corners).astype(np.float64)
    for target, weight in zip(primitive.targets, weights):
        if weight and "POSITION" in target:
            vertices += weight * glb.values(target["POSITION"], ("VEC3",), corners)
    return vertices


def _faces(glb: Glb, primitive: Primitive, count: int) -> Int[np.ndarray, "m 3"]:
    """The triangles (glTF 2.0, section 3.7.2.1)."""
    if primitive.indices is None:
        order = np.arange(count)
    else:
        order = glb.values(primitive.indices, ("SCALAR",))[:, 0]
        if order.dtype.kind != "i" or order.min() < 0 or order.max() >= count:
            raise GlbError(f"triangles use corners beyond the {count} that are there")
    if primitive.mode == _TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if primitive.mode == _FAN:
        return np.stack([order[1:-1], order[2:], np.full(max(len(order) - 2, 0), order[0])], axis=1)
    faces = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    faces[1::2] = faces[1::2, ::-1]
    return faces
