"""The surfaces of a GLB file."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, Int

from torc.errors import InputError
from torc.scenes.importing.reading.glb import Glb, GlbError, entry
from torc.scenes.importing.reading.gltf_looks import GltfLooks
from torc.scenes.importing.reading.gltf_nodes import placed_nodes
from torc.scenes.importing.reading.gltf_schema import Primitive
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import Surface

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def read_glb(data: bytes, reading: Reading) -> Iterator[Surface]:
    """The surfaces of the scene that a GLB file shows. See `SurfaceReader`."""
    glb = Glb(data, reading.path)
    looks = None if reading.neighbours is None else GltfLooks(glb, reading)
    try:
        for node, T_scene_node in placed_nodes(glb.gltf):
            if node.mesh is None:
                continue
            mesh = entry(glb.gltf.meshes, node.mesh, "meshes")
            weights = mesh.weights if node.weights is None else node.weights
            for primitive in mesh.primitives:
                if primitive.mode in (_TRIANGLES, _STRIP, _FAN):  # the rest are points and lines
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
    vertices = _positions(glb, primitive, weights)
    vertices = vertices @ T_scene_node[:3, :3].T + T_scene_node[:3, 3]
    faces = _faces(glb, primitive, len(vertices))
    if np.linalg.det(T_scene_node[:3, :3]) < 0:
        faces = faces[:, ::-1]
    return Surface(vertices, faces) if looks is None else looks.dressed(Surface(vertices, faces), primitive)


def _positions(glb: Glb, primitive: Primitive, weights: Sequence[float]) -> Float[np.ndarray, "n 3"]:
    """The corners, with the morph targets that are on by default (glTF 2.0, section 3.7.2.2)."""
    if "POSITION" not in primitive.attributes:
        raise GlbError("a part has no POSITION")
    vertices = glb.values(primitive.attributes["POSITION"], ("VEC3",)).astype(np.float64)
    for target, weight in zip(primitive.targets, weights):
        if weight and "POSITION" in target:
            moved = glb.values(target["POSITION"], ("VEC3",))
            if len(moved) != len(vertices):
                raise GlbError(f"a morph target has {len(moved)} corners for {len(vertices)}")
            vertices += weight * moved
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
