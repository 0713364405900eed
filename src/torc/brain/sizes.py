"""Whether the things in sight have sizes that make sense: if not, the unit of depth is probably wrong."""

import numpy as np

from torc.records import SegmentedScene

_LARGEST_M, _SMALLEST_M = 0.33, 0.015
"""Between these lies the median length of things on a table: twice the largest of the shipped problems, whose medians
are .07 to .16 m, and a fifth of the smallest, since little may be seen of a thing."""
_USUAL_M = 0.12
_FACTORS = (4, 5, 10, 1000)
_FEWEST = 3


def size_doubts(scene: SegmentedScene) -> tuple[str, ...]:
    """A message if most things in sight are far too large or too small for things that a hand picks."""
    sizes = [_length_m(o.points) for o in scene.objects if len(o.points) > 20]
    if len(sizes) < _FEWEST:
        return ()
    median = float(np.median(sizes))
    if _SMALLEST_M < median < _LARGEST_M:
        return ()
    large = median > _LARGEST_M
    fit = sorted(_FACTORS, key=lambda f: abs(np.log((median / f if large else median * f) / _USUAL_M)))[:2]
    bound, how = ("over", "smaller") if large else ("under", "larger")
    factors = " or ".join(map(str, sorted(fit)))
    return (
        f"Half of the objects seem to be {bound} {100 * median:.1f} cm long. The depth's unit is probably wrong: they "
        f"would be of usual size with a depth_scale {how} by a factor of {factors}.",
    )


def _length_m(points: np.ndarray) -> float:
    """The longer side of what is seen of a thing."""
    low, high = np.percentile(points, [5, 95], axis=0)
    return float((high - low).max())
