"""Object models: what the simulator needs to know of a thing.

Model frame: origin at the centre of the contact pieces' bounding box, z up in the natural standing pose, the front of
a label towards -x (so that with the identity rotation it faces a robot at the origin that looks along +x). Metres.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from torc.geometry.transforms import Pose, make_pose, rotation_from_wxyz

PieceKind = Literal["box", "cylinder", "sphere", "capsule", "ellipsoid", "mesh"]
Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class CollisionPiece:
    """One convex contact piece, with its pose in the model frame.

    Attributes:
        size: as in MuJoCo: box half edges; cylinder and capsule (radius, half length without caps) along the piece's z;
            sphere (radius,); ellipsoid half axes; mesh ().
        vertices: of a mesh, in the piece's frame; the piece is their convex hull. None for primitives.
        relative_density: relative to the object's other pieces, for the distribution of its mass.
    """

    kind: PieceKind
    size: tuple[float, ...] = ()
    position: Vec3 = (0.0, 0.0, 0.0)
    wxyz: Quat = (1.0, 0.0, 0.0, 0.0)
    vertices: Float[np.ndarray, "n 3"] | None = None
    relative_density: float = 1.0

    @cached_property
    def T_object_piece(self) -> Pose:
        """Pose of the piece in the model frame."""
        return make_pose(rotation_from_wxyz(self.wxyz), self.position)

    @property
    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Lower and upper corner of its axis-aligned bounding box in the model frame (exact)."""
        return np.stack([-self.support(-np.eye(3)), self.support(np.eye(3))])

    def support(self, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Return the support function: the largest p . direction over its points p, model frame; unit directions."""
        T = self.T_object_piece
        d = directions @ T[:3, :3]
        base = directions @ T[:3, 3]
        s = self.size
        if self.kind == "box":
            return base + np.abs(d) @ np.array(s)
        if self.kind == "sphere":
            return base + s[0]
        if self.kind == "ellipsoid":
            return base + np.linalg.norm(d * np.array(s), axis=1)
        if self.kind == "capsule":
            return base + s[0] + s[1] * np.abs(d[:, 2])
        if self.kind == "cylinder":
            return base + s[0] * np.hypot(d[:, 0], d[:, 1]) + s[1] * np.abs(d[:, 2])
        return base + (d @ self.mesh_vertices.T).max(axis=1)

    @property
    def mesh_vertices(self) -> Float[np.ndarray, "n 3"]:
        """Vertices of a mesh piece. Raises ValueError for a primitive."""
        if self.vertices is None:
            raise ValueError(f"A {self.kind} has no vertices.")
        return self.vertices

    @cached_property
    def _hull(self) -> Any:
        from scipy.spatial import ConvexHull  # slow to import, rarely needed

        return ConvexHull(self.mesh_vertices)

    @cached_property
    def volume_m3(self) -> float:
        """Its volume."""
        s = self.size
        if self.kind == "box":
            return 8.0 * s[0] * s[1] * s[2]
        if self.kind == "sphere":
            return 4.0 / 3.0 * np.pi * s[0] ** 3
        if self.kind == "ellipsoid":
            return 4.0 / 3.0 * np.pi * s[0] * s[1] * s[2]
        if self.kind == "cylinder":
            return 2.0 * np.pi * s[0] ** 2 * s[1]
        if self.kind == "capsule":
            return np.pi * s[0] ** 2 * (2.0 * s[1] + 4.0 / 3.0 * s[0])
        return float(self._hull.volume)

    @property
    def thickness_m(self) -> float:
        """Its thickness: a primitive's where it is thinnest, a mesh's mean (volume by half the surface)."""
        return 2.0 * min(self.size) if self.size else float(2.0 * self._hull.volume / self._hull.area)

    def contains(self, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
        """Return which points, model frame, lie inside it."""
        T = self.T_object_piece
        p = (points - T[:3, 3]) @ T[:3, :3]
        s = self.size
        if self.kind == "box":
            return (np.abs(p) <= np.array(s)).all(axis=1)
        if self.kind == "sphere":
            return np.linalg.norm(p, axis=1) <= s[0]
        if self.kind == "ellipsoid":
            return np.linalg.norm(p / np.array(s), axis=1) <= 1.0
        if self.kind == "cylinder":
            return (np.hypot(p[:, 0], p[:, 1]) <= s[0]) & (np.abs(p[:, 2]) <= s[1])
        if self.kind == "capsule":
            over = np.maximum(np.abs(p[:, 2]) - s[1], 0.0)
            return np.linalg.norm(np.stack([p[:, 0], p[:, 1], over], axis=1), axis=1) <= s[0]
        planes = self._hull.equations
        return (p @ planes[:, :3].T + planes[:, 3] <= 1e-9).all(axis=1)


@dataclass(frozen=True, eq=False)
class VisualMesh:
    """One visible surface, model frame.

    Triangles are counter-clockwise seen from outside, normals (per vertex) of unit length; `rgba` is the colour without
    a texture, white with one. `uv` per vertex: u to the right and v *down* the texture; (0, 0) is the outer corner of
    texture[0, 0], which is also MuJoCo's convention for user data.
    """

    vertices: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    uv: Float[np.ndarray, "n 2"] | None = None
    texture: UInt8[np.ndarray, "h w 3"] | None = None
    rgba: Quat = (1.0, 1.0, 1.0, 1.0)
    normals: Float[np.ndarray, "n 3"] | None = None


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """One variant ("tuna_can_blue") of one kind ("tuna_can") of object.

    Attributes:
        description: short and unique words, e.g. "the blue tuna can".
        visuals: what a camera sees; agrees with the pieces, its contact geometry, within about 2 mm.
        size_m: edge lengths of the bounding box of the pieces.
        rolls: round contacts: the simulator adds rolling friction.
        held_out: of a kind that the grasp model is never trained on.
    """

    name: str
    kind: str
    description: str
    mass_kg: float
    pieces: tuple[CollisionPiece, ...]
    visuals: tuple[VisualMesh, ...]
    size_m: Vec3
    rolls: bool = False
    friction: float = 0.8
    held_out: bool = False

    @cached_property
    def piece_masses_kg(self) -> tuple[float, ...]:
        """The mass of each piece, by volume and relative density; they sum to mass_kg."""
        weights = np.array([p.volume_m3 * p.relative_density for p in self.pieces])
        return tuple(float(m) for m in self.mass_kg * weights / weights.sum())

    def support(self, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Return the support function of all pieces together, model frame; unit directions."""
        return np.max([p.support(directions) for p in self.pieces], axis=0)


def pieces_bounds(pieces: tuple[CollisionPiece, ...] | list[CollisionPiece]) -> Float[np.ndarray, "2 3"]:
    """Return the lower and upper corner of the bounding box of some pieces."""
    bounds = np.stack([p.bounds for p in pieces])
    return np.stack([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)])
