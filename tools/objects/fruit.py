"""Fruit."""

import numpy as np

from tools.objects.bottles import LYING
from tools.objects.labels import gradient, rgb, rgba, speckled
from tools.objects.meshes import moved, revolve, sweep
from tools.objects.parts import Parts, hull, ring_points, rod
from torc.objects.models import CollisionPiece, VisualMesh

STEM = rgba("#5a4020")


def round_fruit(
    radii_m: tuple[float, float], color: str, spots: str, dimple_m: float, leaf: bool = False
) -> Parts:
    """An apple or an orange: an ellipsoid (radius, half height) with a dimple and a stem."""
    a, c = radii_m
    t = np.linspace(np.pi / 2, -np.pi / 2, 21)
    r, z = a * np.cos(t), c * np.sin(t)
    depth = np.where(z > 0, dimple_m, min(dimple_m, 0.0015))
    z = z - np.sign(z) * depth * np.exp(-((r / (0.25 * a)) ** 2))
    visuals = [revolve(_profile(r, z), texture=speckled(color, spots, 160, radius=1))]
    top = float(z[0])
    if leaf:
        visuals.append(_stem(top - 0.0005, c - 0.0005, 0.004, "#4f7a2c"))
    else:
        visuals.append(_stem(top - 0.001, c, 0.0016, "#5a4020"))
    return Parts([CollisionPiece("ellipsoid", (a, a, c))], visuals)


def _profile(r: np.ndarray, z: np.ndarray) -> list[tuple[float, float]]:
    return [(float(x) if x > 1e-9 else 0.0, float(y)) for x, y in zip(r, z)]


def _stem(z0: float, z1: float, radius: float, color: str) -> VisualMesh:
    profile = [(0.0, z1), (radius, z1), (radius, z0), (0.0, z0)]
    return revolve(profile, segments=10, rgba=rgba(color))


def lemon(radius_m: float, length_m: float, color: str, spots: str) -> Parts:
    """A lemon that lies along y, with a nub at each end."""
    a, half, nub = radius_m, length_m / 2, 0.007
    c = half - 0.004
    z = half * np.sin(np.linspace(np.pi / 2, -np.pi / 2, 25))
    body = a * np.sqrt(np.maximum(0.0, 1 - (z / c) ** 2))
    tip = np.sqrt(np.maximum(0.0, nub**2 - np.maximum(0.0, np.abs(z) - (half - nub)) ** 2))
    skin = revolve(_profile(np.maximum(body, tip), z), texture=speckled(color, spots, 160, radius=1))
    pieces = [
        CollisionPiece("ellipsoid", (a, c, a)),
        rod((0, -half + nub, 0), (0, half - nub, 0), nub, "capsule"),
    ]
    return Parts(pieces, [moved(skin, LYING)])


def pear(radius_m: float, height_m: float, colors: tuple[str, ...]) -> Parts:
    """A pear that stands on a small flat."""
    r, h = radius_m, height_m
    z = h * np.array([0.0, 0.05, 0.15, 0.28, 0.42, 0.58, 0.74, 0.88, 0.96, 1.0])
    radii = r * np.array([0.5, 0.72, 0.92, 1.0, 0.95, 0.77, 0.58, 0.44, 0.28, 0.0])
    profile = [(float(x), float(y)) for x, y in zip(radii[::-1], z[::-1])]
    skin = revolve([*profile, (0.0, 0.0)], texture=gradient(colors))
    rings = [ring_points(max(float(x), 0.004), float(y), 16) for x, y in zip(radii, z)]
    return Parts([hull(np.concatenate(rings))], [skin, _stem(h - 0.002, h + 0.0015, 0.0016, "#5a4020")])


def banana(length_m: float, radius_m: float, colors: tuple[str, str]) -> Parts:
    """A banana that lies: five capsules along an arc in the plane of the table."""
    R, half, r = length_m / 1.62, 0.66, radius_m
    knots = _arc(R, np.linspace(-half, half, 6))
    radii = r * np.array([0.92, 0.99, 1.0, 0.99, 0.86])
    pieces = [rod(knots[i], knots[i + 1], float(radii[i]), "capsule") for i in range(5)]
    stem = _arc(R, np.array([half + 0.05, half + 0.25]))
    pieces.append(rod(stem[0], stem[1], 0.3 * r))
    low, high = -half - radii[0] / R, half + 0.25
    t = np.concatenate(
        [np.linspace(low, -half, 8), np.linspace(-half, half, 25)[1:], np.linspace(half, high, 14)[1:]]
    )
    middles = np.linspace(-0.8, 0.8, 5) * half
    beyond = (
        np.maximum(np.abs(t) - half, 0.0) * R
    )  # how far past the last knot: the caps of the capsules are round
    taper = np.sqrt(np.maximum(np.interp(t, middles, radii) ** 2 - beyond**2, (0.3 * r) ** 2))
    ends = np.interp(t, [low, -half, half, high], [1.0, 0.0, 0.0, 1.0]) ** 2
    peel = _along(t, ends, colors)
    return Parts(pieces, [sweep(_arc(R, t), taper, texture=peel)])


def _along(t: np.ndarray, ends: np.ndarray, colors: tuple[str, str]) -> np.ndarray:
    """Texture of a swept fruit: the second colour where `ends` is one. v is the index along the path."""
    v = np.interp(np.linspace(0, len(t) - 1, 128), np.arange(len(t)), ends)[:, None]
    column = (1 - v) * np.array(rgb(colors[0])) + v * np.array(rgb(colors[1]))
    return np.repeat(np.round(column).astype(np.uint8)[:, None], 32, axis=1)


def _arc(radius: float, angles: np.ndarray) -> np.ndarray:
    return np.stack([radius * (np.cos(angles) - 1), radius * np.sin(angles), 0 * angles], axis=1)
