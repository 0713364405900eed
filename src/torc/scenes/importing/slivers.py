"""Triangles without area in a net of triangles: their neighbours take their corners, so that no gap is left."""

import numpy as np
from jaxtyping import Bool, Float, Int

_FLAT = 1e-9
"""Area against the square of the longest edge."""
_MAX_TURNS = 200_000


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
    that corner. Those that have no neighbour there are left out.
    """
    flat = flat_faces(vertices, faces)
    if not flat.any():
        return faces
    near = np.isin(faces, faces[flat]).any(axis=1)
    region = _Region(vertices, faces[near])
    region.turn_all()
    rest = np.array(list(region.faces.values()), np.int64).reshape(-1, 3)
    return np.concatenate([faces[~near], rest[~flat_faces(vertices, rest)]])


class _Region:
    """Triangles around those without area, by their directed edges."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._vertices = vertices
        self.faces = {i: tuple(face) for i, face in enumerate(faces.tolist())}
        self._owner: dict[tuple[int, int], int] = {}
        self._crowded: set[tuple[int, int]] = set()  # of more than one triangle: nothing is turned there
        for i, face in self.faces.items():
            for edge in _edges(face):
                if edge in self._owner:
                    self._crowded.add(edge)
                self._owner[edge] = i
        self._flat = [i for i, flat in enumerate(flat_faces(vertices, faces)) if flat]

    def turn_all(self) -> None:
        """Turns the longest edges of triangles without area until there are none, or it does not help."""
        waited = 0  # those beyond which lies another one wait for that to go
        for _ in range(min(100 * len(self._flat), _MAX_TURNS)):
            if not self._flat:
                return
            i = self._flat.pop(0)
            done = self._turn(i, waited > len(self._flat))
            waited = 0 if done else waited + 1
            if not done:
                self._flat.append(i)

    def _turn(self, i: int, anyway: bool) -> bool:
        """Turns one; False if it should wait."""
        face = self.faces.get(i)
        if face is None or not self._is_flat(face):
            return True
        p, q, middle = self._from_longest(face)
        j = self._owner.get((q, p))
        if j is None or j == i or (p, q) in self._crowded or (q, p) in self._crowded:
            return anyway
        beyond = next(corner for corner in self.faces[j] if corner not in (p, q))
        if beyond == middle:  # two sides of one sheet without area
            self._remove(i)
            self._remove(j)
            return True
        if self._is_flat(self.faces[j]) and not anyway:
            return False
        if (middle, beyond) in self._owner or (beyond, middle) in self._owner:
            return anyway
        self._remove(i)
        self._remove(j)
        self._add(i, (p, beyond, middle))
        self._add(j, (q, middle, beyond))
        return True

    def _from_longest(self, face: tuple[int, int, int]) -> tuple[int, int, int]:
        lengths = [float(np.linalg.norm(self._vertices[b] - self._vertices[a])) for a, b in _edges(face)]
        k = int(np.argmax(lengths))
        return face[k], face[(k + 1) % 3], face[(k + 2) % 3]

    def _is_flat(self, face: tuple[int, int, int]) -> bool:
        return bool(flat_faces(self._vertices, np.array([face]))[0])

    def _remove(self, i: int) -> None:
        for edge in _edges(self.faces.pop(i)):
            if self._owner.get(edge) == i:
                del self._owner[edge]

    def _add(self, i: int, face: tuple[int, int, int]) -> None:
        self.faces[i] = face
        for edge in _edges(face):
            self._owner[edge] = i
        if self._is_flat(face):
            self._flat.append(i)


def _edges(face: tuple[int, int, int]) -> tuple[tuple[int, int], ...]:
    a, b, c = face
    return (a, b), (b, c), (c, a)
