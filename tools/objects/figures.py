"""Toy figures made of balls and limbs: animals on four legs, bath ducks."""

import numpy as np

from tools.objects.labels import rgba, speckled
from tools.objects.meshes import Texture, arc, ellipsoid_mesh, moved, revolve
from tools.objects.parts import Parts, frustum, rod
from torc.geometry.transforms import rotation_from_wxyz
from torc.objects.models import CollisionPiece, Quat, Vec3, VisualMesh

EYE: Quat = (0.06, 0.06, 0.06, 1.0)


class _Figure:
    """Collects the balls and limbs of a figure, each as a contact piece and a surface alike."""

    def __init__(self) -> None:
        self.pieces: list[CollisionPiece] = []
        self.visuals: list[VisualMesh] = []

    def ball(self, center: Vec3, half_axes: Vec3, color: str) -> None:
        """An ellipsoid."""
        self.pieces.append(CollisionPiece("ellipsoid", half_axes, center))
        self.visuals.append(moved(ellipsoid_mesh(half_axes, rgba=rgba(color)), position=center))

    def limb(self, start: Vec3, end: Vec3, radius: float, color: str, texture: Texture = None) -> None:
        """A capsule between two centres."""
        piece = rod(start, end, radius, "capsule")
        half = piece.size[1]
        top = arc((0.0, half), radius, np.pi / 2, 0.0, 7)
        low = arc((0.0, -half), radius, 0.0, -np.pi / 2, 7)
        profile = [(0.0, half + radius), *top[1:], *low[:-1], (0.0, -half - radius)]
        skin = {"rgba": rgba(color)} if texture is None else {"texture": texture}
        surface = revolve(profile, segments=28, **skin)
        self.pieces.append(piece)
        self.visuals.append(moved(surface, rotation_from_wxyz(piece.wxyz), piece.position))

    def leg(self, x: float, y: float, height: float, radius: float, color: str) -> None:
        """An upright leg with a flat foot."""
        self.pieces.append(CollisionPiece("cylinder", (radius, height / 2), (x, y, height / 2)))
        outline = [(0.0, height), (radius, height), (radius, 0.0), (0.0, 0.0)]
        self.visuals.append(moved(revolve(outline, segments=20, rgba=rgba(color)), position=(x, y, 0)))

    def eyes(self, center: Vec3, apart: float, radius: float) -> None:
        """Two small black balls left and right (along x) of a point; to look at only."""
        x, y, z = center
        for side in (-1, 1):
            eye = ellipsoid_mesh((radius, radius, radius), rgba=EYE)
            self.visuals.append(moved(eye, position=(x + side * apart, y, z)))

    def parts(self) -> Parts:
        """All of it."""
        return Parts(self.pieces, self.visuals)


def animal(
    body_m: tuple[float, float],
    legs_m: tuple[float, float],
    neck_m: tuple[float, float, float],
    head_m: tuple[float, float],
    ears_m: tuple[float, float],
    snout_m: tuple[float, float],
    color: str,
    accent: str,
    trunk: bool = False,
    spots: int = 0,
) -> Parts:
    """An animal that stands on four legs and looks to the right (-y).

    body: radius, length; legs: length, radius; neck: radius, how far it goes up and forward; head: half length,
    radius; ears: radius, height above the middle of the head; snout: radius, length. `spots`: number of spots on the
    body, in the accent's colour; `trunk`: an elephant's.
    """
    figure = _Figure()
    (r, length), (leg, leg_r), (neck_r, up, forward), (head, head_r) = body_m, legs_m, neck_m, head_m
    half, z = length / 2 - r, leg + 0.8 * r
    hide = speckled(color, accent, spots, 256, 128, radius=12) if spots else None
    figure.limb((0, half, z), (0, -half, z), r, color, hide)
    for x in (-0.6 * r, 0.6 * r):
        for y in (-half - 0.1 * r, half + 0.1 * r):
            figure.leg(x, y, z - 0.3 * r, leg_r, color)
    chest = (0.0, -half - 0.2 * r, z + 0.35 * r)
    skull = (0.0, chest[1] - forward, chest[2] + up)
    figure.limb(chest, skull, neck_r, color)
    figure.ball((0.0, skull[1] - 0.3 * head, skull[2]), (head_r, head, head_r), color)
    nose = skull[1] - 1.0 * head
    if trunk:
        tip = (0.0, nose - 0.75 * head, leg * 0.75)
        bend = (0.0, nose - 0.40 * head, skull[2] - 0.75 * head)
        figure.limb((0.0, nose, skull[2] - 0.1 * head), bend, snout_m[0], color)
        figure.limb(bend, tip, 0.85 * snout_m[0], color)
    else:
        low = skull[2] - 0.2 * head_r
        figure.limb((0.0, nose, low), (0.0, nose - snout_m[1], low), snout_m[0], accent)
    ear, high = ears_m
    for side in (-1, 1):
        at = (side * (head_r + (0.001 if trunk else -0.3 * ear)), skull[1] + 0.1 * head, skull[2] + high)
        figure.ball(
            at, (0.0028, ear, 1.15 * ear) if trunk else (ear, 0.0035, 1.3 * ear), color if trunk else accent
        )
    figure.eyes((0.0, skull[1] - 0.75 * head, skull[2] + 0.35 * head_r), 0.72 * head_r, 0.1 * head_r + 0.0008)
    figure.limb((0, half + 0.7 * r, z + 0.4 * r), (0, half + 1.2 * r, z - 0.5 * r), 0.0025, accent)
    return figure.parts()


def rubber_duck(length_m: float, color: str, beak: str) -> Parts:
    """A bath duck that looks to the front right: body, tail, head, beak; flat below."""
    s = length_m / 0.09
    figure = _Figure()
    body = (0.032 * s, 0.040 * s, 0.026 * s)
    figure.ball((0, 0, 0.026 * s), body, color)
    foot, high = 0.021 * s, 0.010 * s
    figure.pieces.append(frustum(foot, 0, 0.026 * s, high))
    figure.visuals.append(revolve([(0.026 * s, high), (foot, 0), (0, 0)], rgba=rgba(color)))
    figure.limb((0, 0.028 * s, 0.030 * s), (0, 0.042 * s, 0.043 * s), 0.007 * s, color)
    head = (0.0, -0.024 * s, 0.059 * s)
    figure.ball(head, (0.0215 * s, 0.0215 * s, 0.0215 * s), color)
    figure.ball((0, head[1] - 0.024 * s, head[2] - 0.003 * s), (0.010 * s, 0.012 * s, 0.0042 * s), beak)
    figure.eyes((0, head[1] - 0.0155 * s, head[2] + 0.0075 * s), 0.0125 * s, 0.003 * s)
    for side in (-1, 1):
        figure.ball((side * 0.0285 * s, 0.006 * s, 0.030 * s), (0.006 * s, 0.020 * s, 0.011 * s), color)
    return figure.parts()
