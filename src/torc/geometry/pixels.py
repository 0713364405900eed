"""How fine a camera's picture is: settings in pixels are meant for a picture of a certain size."""

WIDTH_PX, HEIGHT_PX = 640, 480
"""Of the picture for which settings in pixels were chosen."""


def finer(shape: tuple[int, ...]) -> float:
    """How many times as many pixels a picture (rows, columns) has along a line; 1 for smaller ones."""
    return max(1.0, (shape[0] * shape[1] / (WIDTH_PX * HEIGHT_PX)) ** 0.5)
