"""Hand tools, all lying on the table along y."""

import numpy as np

from tools.objects.bottles import LYING
from tools.objects.labels import rgba
from tools.objects.meshes import box_mesh, facetted, loft, moved, revolve
from tools.objects.parts import Parts, box, hull, ring_points, rod
from torc.geometry.transforms import rotation_about
from torc.objects.models import VisualMesh

STEEL = (0.62, 0.63, 0.66, 1.0)
DARK_STEEL = (0.32, 0.33, 0.36, 1.0)


def screwdriver(
    handle_m: tuple[float, float], shaft_m: tuple[float, float], color: str, accent: str
) -> Parts:
    """A screwdriver; handle and shaft as (length, radius). The handle has six sides, so it does not roll."""
    (length, r), (shaft, shaft_r) = handle_m, shaft_m
    flat_below = LYING @ rotation_about((0, 0, 1), np.pi / 6)
    z = np.array([0.0, 0.06, 0.72, 0.86, 1.0]) * length
    radii = r * np.array([0.8, 1.0, 1.0, 0.82, 0.8])
    profile = [(0.0, z[-1]), *zip(radii[::-1], z[::-1]), (0.0, 0.0)]
    grip = facetted(revolve(profile, segments=6, rgba=rgba(color)))
    collar = revolve([(0, 0.0015), (0.5 * r, 0.0015), (0.72 * r, 0), (0, 0)], segments=20, rgba=rgba(accent))
    tip = length + shaft
    blade = box_mesh((1.9 * shaft_r, 0.012, 1.2 * shaft_r), (0, tip - 0.006, 0), rgba=STEEL)
    rod_mesh = revolve(
        [(0, tip - 0.008), (shaft_r, tip - 0.01), (shaft_r, length), (0, length)], segments=16, rgba=STEEL
    )
    visuals = [moved(grip, flat_below), moved(collar, LYING, (0, length, 0)), moved(rod_mesh, LYING), blade]
    low = [ring_points(x, y, 6) @ flat_below.T for x, y in zip(radii[:3], z[:3])]
    high = [ring_points(x, y, 6) @ flat_below.T for x, y in zip(radii[2:], z[2:])]
    pieces = [
        hull(np.concatenate(low)),
        hull(np.concatenate([high[0], high[2]])),
        rod((0, length, 0), (0, tip, 0), shaft_r, relative_density=6.0),
    ]
    return Parts(pieces, visuals)


def hammer(length_m: float, handle: str, grip: str) -> Parts:
    """A claw hammer: wooden handle along y, head along x at the far end, face towards -x."""
    r, end = 0.014, length_m - 0.013
    split = 0.45 * length_m
    shaft = revolve(
        [(0, end), (0.85 * r, end), (0.85 * r, split), (0, split)], segments=24, rgba=rgba(handle)
    )
    rubber = revolve(
        [(0, split + 0.002), (0.95 * r, split), (r, 0.06), (r, 0.004), (r - 0.004, 0), (0, 0)],
        segments=24,
        rgba=rgba(grip),
    )
    head = (0.030, 0.024, 0.026)
    face = revolve([(0, 0.03), (r, 0.027), (r, 0.008), (0.7 * r, 0), (0, 0)], segments=24, rgba=STEEL)
    claw = _claw(end)
    visuals = [
        moved(shaft, LYING),
        moved(rubber, LYING),
        box_mesh(head, (0, end, 0), rgba=DARK_STEEL),
        moved(face, rotation_about((0, 1, 0), -np.pi / 2), (-0.013, end, 0)),
        facetted(loft(claw, rgba=DARK_STEEL)),
    ]
    pieces = [
        rod((0, 0, 0), (0, split, 0), 0.98 * r),
        rod((0, split, 0), (0, end, 0), 0.85 * r),
        box(head, (0, end, 0), relative_density=8.0),
        rod((-0.013, end, 0), (-0.043, end, 0), r, relative_density=8.0),
        hull(claw[:2].reshape(-1, 3), relative_density=8.0),
        hull(claw[1:].reshape(-1, 3), relative_density=8.0),
    ]
    return Parts(pieces, visuals)


def _claw(y: float) -> np.ndarray:
    """Three rectangular rings of the claw, from its tip to the head; it bends towards the handle."""
    rings = []
    for x, dy, half_y, half_z in (
        (0.058, -0.014, 0.002, 0.012),
        (0.038, -0.003, 0.006, 0.012),
        (0.014, 0, 0.011, 0.012),
    ):
        rings.append([(x, y + dy + a * half_y, b * half_z) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return np.array(rings)


def clamp(size_m: tuple[float, float], color: str) -> Parts:
    """A screw clamp, lying: a C of three bars (x, y extent), a screw along y with a cross bar."""
    depth, width = size_m
    bar, thick, screw_r = 0.014, 0.016, 0.005
    x_screw = -(depth - bar)
    frame = [
        ((bar, width, thick), (0.0, 0.0, 0.0)),
        ((depth, bar, thick), ((bar - depth) / 2, (width - bar) / 2, 0.0)),
        ((depth, bar, thick), ((bar - depth) / 2, -(width - bar) / 2, 0.0)),
    ]
    start, end = (x_screw, -width / 2 - 0.045, 0.0), (x_screw, 0.16 * width, 0.0)
    cross = (x_screw - 0.022, start[1] + 0.004, 0.0), (x_screw + 0.022, start[1] + 0.004, 0.0)
    pad = (x_screw, end[1], 0.0), (x_screw, end[1] + 0.006, 0.0)
    rods = [(start, end, screw_r), (*cross, 0.0035), (*pad, 0.008)]
    visuals = [box_mesh(size, position, rgba=rgba(color)) for size, position in frame]
    visuals += [_rod_mesh(np.array(a), np.array(b), r) for a, b, r in rods]
    pieces = [box(size, position) for size, position in frame]
    pieces += [rod(a, b, r) for a, b, r in rods]
    return Parts(pieces, visuals)


def _rod_mesh(a: np.ndarray, b: np.ndarray, radius: float) -> VisualMesh:
    """A cylinder's surface between two points, along x or y."""
    half = float(np.linalg.norm(b - a)) / 2
    mesh = revolve([(0, half), (radius, half), (radius, -half), (0, -half)], segments=16, rgba=STEEL)
    R = LYING if abs(b[1] - a[1]) > abs(b[0] - a[0]) else rotation_about((0, 1, 0), np.pi / 2)
    return moved(mesh, R, (a + b) / 2)
