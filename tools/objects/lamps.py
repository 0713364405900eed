"""Light bulbs."""

import numpy as np

from tools.objects.labels import rgba
from tools.objects.meshes import arc, revolve
from tools.objects.parts import Parts, cylinder, frustum, turned
from torc.geometry.transforms import rotation_about
from torc.objects.models import CollisionPiece

BRASS = (0.72, 0.70, 0.62, 1.0)
_TAPER_RAD = 0.85
"""Where the round glass goes over into the neck, below its equator."""


def light_bulb(radius_m: float, length_m: float, cap_m: tuple[float, float], glass: str, neck: str) -> Parts:
    """A light bulb that lies on its glass and the edge of its cap, the cap towards -y; cap: radius, length."""
    (r_cap, cap), r = cap_m, radius_m
    middle, thread = length_m - r, 0.0005
    low, wide = middle - r * np.sin(_TAPER_RAD), r * np.cos(_TAPER_RAD)
    collar = low - 0.45 * (low - cap)
    r_collar = wide + (r_cap + 0.001 - wide) * (low - collar) / (low - cap)
    z = np.linspace(cap, 0.004, 11)
    screw = [(r_cap + thread * (-1) ** k, float(h)) for k, h in enumerate(z)]
    dome = arc((0.0, middle), r, np.pi / 2, -_TAPER_RAD, 14)
    visuals = [
        revolve([(0.0, length_m), *dome[1:]], rgba=rgba(glass)),
        revolve([(wide, low), (r_collar, collar)], rgba=rgba(glass)),
        revolve([(r_collar, collar), (r_cap + 0.001, cap)], rgba=rgba(neck)),
        revolve(screw, segments=28, rgba=BRASS),
        revolve([screw[-1], (0.35 * r_cap, 0.0), (0.0, 0.0)], segments=28, rgba=(0.2, 0.2, 0.2, 1.0)),
    ]
    pieces = [
        CollisionPiece("sphere", (r,), (0.0, 0.0, middle)),
        frustum(r_cap + 0.001, cap, wide, low),
        cylinder(r_cap, 0.003, cap, relative_density=4.0),
    ]
    # Lying, a common tangent of glass and cap is the table.
    reach = float(np.hypot(middle, r_cap))
    tilt = np.arcsin(r / reach) - np.arctan2(r_cap, middle)
    return turned(Parts(pieces, visuals), rotation_about((1, 0, 0), -(np.pi / 2 - tilt)))
