"""How fine a camera's picture is: settings in pixels are meant for a certain focal length."""

FOCAL_PX = 286.0
"""Of the paper's camera as torc simulates it, 640 x 480 at 80 degrees, for which such settings were chosen."""


def finer(focal_px: float) -> float:
    """How many times as many pixels show the same, along a line; 1 for coarser cameras."""
    # A whole percent: the focal length of the camera above is no round number.
    return max(1.0, round(focal_px / FOCAL_PX, 2))
