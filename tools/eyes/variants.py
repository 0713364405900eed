"""Objects to learn from beyond those of the library: each of them stretched and squeezed along its axes.

A network that has seen only 150 things learns those; stretched ones cost nothing and have other proportions. They are
kept as object files in a store of their own, which TORC_OBJECTS must name wherever they are used.
"""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import transform_points
from torc.objects.library import builtin_object_names, load_object, object_facts
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh, pieces_bounds
from torc.objects.object_files import save_object

_STRETCH = (0.65, 1.45)
_SMALLEST_M, _LARGEST_M = 0.012, 0.26
_RING = 16
"""Corners of a round piece's outline."""


def make_variants(store: Path, per_object: int, seed: int) -> list[str]:
    """Stretched copies of every object of known kinds, into a store; their names. Those that are there stay."""
    names = []
    for index, name in enumerate(builtin_object_names()):
        if object_facts(name).held_out:
            continue
        for k in range(per_object):
            variant = f"{name[:50]}_v{k}"
            if not (store / variant).exists():
                rng = np.random.default_rng([seed, index, k])
                save_object(stretched(load_object(name), variant, rng), store / variant)
            names.append(variant)
    return names


def stretched(model: ObjectModel, name: str, rng: np.random.Generator) -> ObjectModel:
    """The model with other proportions, its mass in proportion to its volume."""
    low, high = np.log(_STRETCH)
    size = np.array(model.size_m)
    scale = np.clip(size * np.exp(rng.uniform(low, high, 3)), _SMALLEST_M, _LARGEST_M) / size
    pieces = [_scaled_piece(piece, scale) for piece in model.pieces]
    lower, upper = pieces_bounds(pieces)
    center = 0.5 * (lower + upper)
    x, y, z = (float(v) for v in upper - lower)
    moved = tuple(replace(p, position=_minus(p.position, center)) for p in pieces)
    return replace(
        model,
        name=name,
        description=f"{model.description}, {name}",
        mass_kg=float(np.clip(model.mass_kg * scale.prod(), 0.005, 2.0)),
        pieces=moved,
        visuals=tuple(_scaled_surface(v, scale, center) for v in model.visuals),
        size_m=(x, y, z),
    )


def piece_corners(piece: CollisionPiece) -> Float[np.ndarray, "n 3"]:
    """Points whose convex hull is the piece (a polygon in place of each circle), model frame."""
    return transform_points(piece.T_object_piece, _own_corners(piece))


def _own_corners(piece: CollisionPiece) -> Float[np.ndarray, "n 3"]:
    if piece.kind == "mesh":
        return piece.mesh_vertices
    if piece.kind == "box":
        return np.array(list(product((-1, 1), repeat=3))) * np.array(piece.size)
    turn = np.linspace(0, 2 * np.pi, _RING, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    if piece.kind == "cylinder":
        radius, half = piece.size
        return np.concatenate([np.column_stack([radius * ring, np.full(_RING, z)]) for z in (-half, half)])
    rise = np.linspace(-np.pi / 2, np.pi / 2, _RING // 2 + 1)
    ball = np.concatenate([np.column_stack([np.cos(a) * ring, np.full(_RING, np.sin(a))]) for a in rise])
    if piece.kind == "ellipsoid":
        return ball * np.array(piece.size)
    if piece.kind == "sphere":
        return ball * piece.size[0]
    radius, half = piece.size  # a capsule
    return np.concatenate([radius * ball + [0, 0, z] for z in (-half, half)])


def _scaled_piece(piece: CollisionPiece, scale: Float[np.ndarray, "3"]) -> CollisionPiece:
    corners = np.unique((piece_corners(piece) * scale).round(7), axis=0)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    x, y, z = (float(v) for v in middle)
    return CollisionPiece(
        "mesh", position=(x, y, z), vertices=corners - middle, relative_density=piece.relative_density
    )


def _scaled_surface(
    mesh: VisualMesh, scale: Float[np.ndarray, "3"], center: Float[np.ndarray, "3"]
) -> VisualMesh:
    normals = mesh.normals
    if normals is not None:
        normals = normals / scale
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(mesh, vertices=mesh.vertices * scale - center, normals=normals)


def _minus(
    position: tuple[float, float, float], center: Float[np.ndarray, "3"]
) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in np.array(position) - center)
    return x, y, z
