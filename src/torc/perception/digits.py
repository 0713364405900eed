"""Numbers as small pictures. Own glyphs, because a library's font changes with its version, and so would images."""

import cv2
import numpy as np
from jaxtyping import UInt8

# 5 x 7 cells per digit, one row of digits after another, '#' is ink.
_GLYPHS = """
.###. ..#.. .###. ##### ...#. ##### ..##. ##### .###. .###.
#...# .##.. #...# ...#. ..##. #.... .#... ....# #...# #...#
#...# ..#.. ....# ..#.. .#.#. ####. #.... ...#. #...# #...#
#...# ..#.. ...#. ...#. #..#. ....# ####. ..#.. .###. .####
#...# ..#.. ..#.. ....# ##### ....# #...# ..#.. #...# ....#
#...# ..#.. .#... #...# ...#. #...# #...# ..#.. #...# ...#.
.###. .###. ##### .###. ...#. .###. .###. ..#.. .###. .##..
"""
_SUPERSAMPLING = 12


def number_image(number: int, height_px: int) -> UInt8[np.ndarray, "h w"]:
    """Ink (0..255) of a number's digits, `height_px` high, without a border."""
    rows = [line.split() for line in _GLYPHS.split("\n") if line]
    gap = "."
    text = [gap.join(row[int(digit)] for digit in str(number)) for row in rows]
    cells = np.array([[255 * (c == "#") for c in line] for line in text], dtype=np.uint8)
    large = np.kron(cells, np.ones((_SUPERSAMPLING, _SUPERSAMPLING), dtype=np.uint8))
    width_px = max(1, round(cells.shape[1] * height_px / cells.shape[0]))
    return cv2.resize(large, (width_px, height_px), interpolation=cv2.INTER_AREA).astype(np.uint8)
