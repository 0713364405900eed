"""Where the parts of a glTF scene are: its tree of nodes."""

from collections.abc import Iterator

import numpy as np

from torc.geometry.transforms import make_pose, rotation_from_wxyz
from torc.scenes.importing.reading.glb import GlbError, entry
from torc.scenes.importing.reading.gltf_schema import Gltf, Node

_INSTANCES = "EXT_mesh_gpu_instancing"


def placed_nodes(gltf: Gltf) -> Iterator[tuple[Node, np.ndarray]]:
    """The nodes of the scene that is shown, and their affine transforms (4, 4) to it.

    Raises:
        GlbError: no tree, or a node that cannot be placed: skinned, or many at once.
    """
    waiting = [(index, np.eye(4)) for index in reversed(_roots(gltf))]
    seen: set[int] = set()
    while waiting:
        index, T_scene_parent = waiting.pop()
        if index in seen:
            raise GlbError(f"nodes[{index}] is below two nodes, or below itself")
        seen.add(index)
        node = entry(gltf.nodes, index, "nodes")
        if _INSTANCES in node.extensions:
            raise GlbError(
                f"nodes[{index}] stands for many copies ({_INSTANCES}); export them as nodes of their own"
            )
        if node.skin is not None and node.mesh is not None:
            raise GlbError(
                f"nodes[{index}] is bent by a skeleton (skin), which is not read; apply its pose and export it without"
            )
        T_scene_node = T_scene_parent @ _matrix(node)
        yield node, T_scene_node
        waiting += [(child, T_scene_node) for child in reversed(node.children)]


def _roots(gltf: Gltf) -> list[int]:
    if gltf.scenes:
        return entry(gltf.scenes, gltf.scene or 0, "scenes").nodes
    below = {child for node in gltf.nodes for child in node.children}
    return [i for i in range(len(gltf.nodes)) if i not in below]


def _matrix(node: Node) -> np.ndarray:
    if node.matrix is not None:
        return np.array(node.matrix).reshape(4, 4).T  # columns first in the file
    x, y, z, w = node.rotation
    length = float(np.linalg.norm(node.rotation)) or 1.0
    R = (
        rotation_from_wxyz((w / length, x / length, y / length, z / length))
        if any(node.rotation)
        else np.eye(3)
    )
    return make_pose(R @ np.diag(node.scale), node.translation)
