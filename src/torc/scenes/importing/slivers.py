"""Triangles without area in a net of triangles: their neighbours take their corners, so that no gap is left."""

import math
from collections import defaultdict, deque

import numpy as np
from jaxtyping import Bool, Float, Int

Face = tuple[int, int, int]
_FLAT = 1e-6
"""Area against the square of the longest edge: above the rounding of files in single precision, and of a thing of 0.3 m
less than a micrometre."""
_MAX_TURNS = 300_000


def flat_faces(vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]) -> Bool[np.ndarray, "m"]:
    """Which triangles have no area to speak of; also those with corners that are not finite."""
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return np.asarray(~(area > _FLAT * edges.max(axis=1, initial=0.0) ** 2))


def without_slivers(
    vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]
) -> Int[np.ndarray, "k 3"]:
    """The net without triangles whose three corners lie on a line, as closed as it was.

    The longest edge of such a triangle, with its middle corner on it, is turned: the neighbour beyond it is split at
    that corner. Where that cannot be, it stays if it has neighbours all around.
    """
    flat = flat_faces(vertices, faces)
    if not flat.any():
        return faces
    near = np.isin(faces, faces[flat]).any(axis=1)
    region = _Region(vertices, faces[near], flat[near])
    region.turn_all()
    return np.concatenate([faces[~near], np.array(region.left(), np.int64).reshape(-1, 3)])


class _Region:
    """Triangles around those without area, by their directed edges."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, flat: np.ndarray) -> None:
        self._vertices = vertices.tolist()
        self._faces: dict[int, Face] = {i: (a, b, c) for i, (a, b, c) in enumerate(faces.tolist())}
        self._flat = set(np.flatnonzero(flat).tolist())
        self._owner: dict[tuple[int, int], int] = {}
        self._crowded: set[tuple[int, int]] = set()  # of more than one triangle: nothing is turned there
        for i, face in self._faces.items():
            for edge in _edges(face):
                if edge in self._owner:
                    self._crowded.add(edge)
                self._owner[edge] = i

    def left(self) -> list[Face]:
        """The triangles, without those that have no area and lie at an open edge."""
        return [face for i, face in self._faces.items() if i not in self._flat or self._is_inside(face)]

    def turn_all(self) -> None:
        """Turns the longest edges of triangles without area until there are none, or it does not help."""
        ready = deque(sorted(self._flat))
        # By the neighbour, also without area, that must go first.
        waiting: dict[int, list[int]] = defaultdict(list)
        for _ in range(_MAX_TURNS):
            if ready:
                i, patient = ready.popleft(), True
            elif waiting:
                _, those = waiting.popitem()
                i, patient = those.pop(), False
                ready.extend(those)
            else:
                return
            if i not in self._flat:
                continue
            p, q, middle = self._from_longest(self._faces[i])
            j = self._owner.get((q, p))
            if j is None or j == i or (p, q) in self._crowded or (q, p) in self._crowded:
                continue
            if patient and j in self._flat:
                waiting[j].append(i)
                continue
            ready.extend(self._turn(i, j, (p, q, middle)))
            ready.extend(waiting.pop(i, []))
            ready.extend(waiting.pop(j, []))

    def _turn(self, i: int, j: int, face: Face) -> list[int]:
        """Turns the edge between two triangles, the first of which has no area; which of the new ones have none."""
        p, q, middle = face
        beyond = next(corner for corner in self._faces[j] if corner not in (p, q))
        if beyond == middle:  # two sides of one sheet without area
            self._remove(i)
            self._remove(j)
            return []
        if (middle, beyond) in self._owner or (beyond, middle) in self._owner:
            return []
        self._remove(i)
        self._remove(j)
        self._add(i, (p, beyond, middle))
        self._add(j, (q, middle, beyond))
        return [k for k in (i, j) if k in self._flat]

    def _is_inside(self, face: Face) -> bool:
        return all((b, a) in self._owner for a, b in _edges(face))

    def _from_longest(self, face: Face) -> Face:
        lengths = [math.dist(self._vertices[a], self._vertices[b]) for a, b in _edges(face)]
        k = lengths.index(max(lengths))
        return face[k], face[(k + 1) % 3], face[(k + 2) % 3]

    def _remove(self, i: int) -> None:
        self._flat.discard(i)
        for edge in _edges(self._faces.pop(i)):
            if self._owner.get(edge) == i:
                del self._owner[edge]

    def _add(self, i: int, face: Face) -> None:
        self._faces[i] = face
        for edge in _edges(face):
            self._owner[edge] = i
        if self._has_no_area(face):
            self._flat.add(i)

    def _has_no_area(self, face: Face) -> bool:
        """As `flat_faces`, of one triangle."""
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (self._vertices[k] for k in face)
        ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        area = math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
        p, q, _ = self._from_longest(face)
        return not area > _FLAT * math.dist(self._vertices[p], self._vertices[q]) ** 2


def _edges(face: Face) -> tuple[tuple[int, int], ...]:
    a, b, c = face
    return (a, b), (b, c), (c, a)
