"""Where the parts of a glTF scene are: its tree of nodes."""

from collections.abc import Iterator

import numpy as np

from torc.geometry.transforms import make_pose, rotation_from_wxyz
from torc.scenes.importing.reading.gltf.glb import GlbError, entry, parsed
from torc.scenes.importing.reading.gltf.schema import Gltf, Node, Visibility
from torc.scenes.importing.reading.request import Reading

_INSTANCES, _VISIBILITY = "EXT_mesh_gpu_instancing", "KHR_node_visibility"
_FARTHEST = 1e30
"""Beyond any file's units, and its products with corners are numbers still."""


def placed_nodes(gltf: Gltf, reading: Reading) -> Iterator[tuple[Node, np.ndarray]]:
    """The nodes of the scene that is shown, and their affine transforms (4, 4) to it; of hidden ones the user is told.

    Raises:
        GlbError: no tree, or a node that cannot be placed: skinned, many at once, or beyond all measure.
    """
    waiting = [(index, np.eye(4)) for index in reversed(_roots(gltf))]
    seen: set[int] = set()
    while waiting:
        index, T_scene_parent = waiting.pop()
        if index in seen:
            raise GlbError(f"nodes[{index}] is below two nodes, or below itself")
        seen.add(index)
        node = entry(gltf.nodes, index, "nodes")
        if _is_hidden(node, index):
            reading.note(f"Hidden nodes ({_VISIBILITY}), and what is below them, were left out.")
            continue
        _check_one(node, index)
        with np.errstate(over="ignore", invalid="ignore"):
            T_scene_node = T_scene_parent @ _matrix(node)
        if not (np.abs(T_scene_node) < _FARTHEST).all():
            raise GlbError(f"nodes[{index}] is moved or scaled beyond all measure")
        yield node, T_scene_node
        waiting += [(child, T_scene_node) for child in reversed(node.children)]


def _roots(gltf: Gltf) -> list[int]:
    if gltf.scenes:
        return entry(gltf.scenes, gltf.scene or 0, "scenes").nodes
    below = {child for node in gltf.nodes for child in node.children}
    return [i for i in range(len(gltf.nodes)) if i not in below]


def _is_hidden(node: Node, index: int) -> bool:
    content = node.extensions.get(_VISIBILITY, {})
    return not parsed(Visibility, content, f"{_VISIBILITY} of nodes[{index}]").visible


def _check_one(node: Node, index: int) -> None:
    """Raises GlbError for a node that is drawn otherwise than once and where it is."""
    if _INSTANCES in node.extensions:
        raise GlbError(
            f"nodes[{index}] stands for many copies ({_INSTANCES}); export them as nodes of their own"
        )
    if node.skin is not None and node.mesh is not None:
        raise GlbError(
            f"nodes[{index}] is bent by a skeleton (skin), which is not read; apply its pose and export it without"
        )


def _matrix(node: Node) -> np.ndarray:
    if node.matrix is not None:
        return np.array(node.matrix).reshape(4, 4).T  # columns first in the file
    largest = max(abs(c) for c in node.rotation)
    if largest == 0:
        return make_pose(np.diag(node.scale), node.translation)
    x, y, z, w = (c / largest for c in node.rotation)  # squares of tiny or huge ones are no numbers
    return make_pose(rotation_from_wxyz((w, x, y, z)) @ np.diag(node.scale), node.translation)
