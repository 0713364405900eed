"""Scale settings in pixels, which are meant for a picture of a certain size, to a camera's resolution."""

WIDTH_PX, HEIGHT_PX = 640, 480
"""Size of the picture for which settings in pixels were chosen."""


def finer(shape: tuple[int, ...]) -> float:
    """Return the ratio of pixels along a line in a picture (rows, columns) to those of the reference; at least 1."""
    return max(1.0, (shape[0] * shape[1] / (WIDTH_PX * HEIGHT_PX)) ** 0.5)
