"""The ChArUco board: printed, and found in pictures."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, Int64, UInt8

from torc import InputError
from torc_lab.protocols import LabError

_LEAST_CORNERS = 8
DICTIONARY = cv2.aruco.DICT_5X5_100


@dataclass(frozen=True)
class Board:
    """A chessboard of columns x rows squares with markers in the white ones. Corners are numbered row by row; the
    board's frame lies in its plane, z away from who looks at it.
    """

    columns: int = 7
    rows: int = 5
    square_m: float = 0.03
    marker_m: float = 0.022

    def __post_init__(self) -> None:
        if not 0.005 <= self.square_m <= 0.2:
            raise InputError(f"Squares of {self.square_m} m: 5 mm to 200 mm are meant. Sizes are in metres.")
        if not (
            3 <= self.columns <= 14 and 3 <= self.rows <= 14 and 0.4 < self.marker_m / self.square_m < 0.9
        ):
            raise InputError(
                f"No board: {self}. It has 3 to 14 columns and rows, and markers of .4 to .9 of a square."
            )

    @cached_property
    def corners(self) -> Float[np.ndarray, "n 3"]:
        """The inner corners in the board's frame, by id, metres."""
        return np.asarray(self._cv.getChessboardCorners(), dtype=float)

    @property
    def size_m(self) -> tuple[float, float]:
        """Of all squares, without a margin."""
        return self.columns * self.square_m, self.rows * self.square_m

    def picture(self, pixels_per_m: float) -> UInt8[np.ndarray, "h w"]:
        """The board as it is to be printed, without a margin."""
        width, height = (round(s * pixels_per_m) for s in self.size_m)
        return np.asarray(self._cv.generateImage((width, height)))

    def find(self, gray: UInt8[np.ndarray, "h w"]) -> "FoundCorners | None":
        """The corners in a picture; None if there are too few. Raises LabError for a board in a mirror."""
        found = self._detected(gray)
        if found is None and self._detected(np.ascontiguousarray(gray[:, ::-1])) is not None:
            raise LabError(
                "The board is mirrored: it was printed the wrong way round, or the picture is mirrored. "
                "Print it again, or set the camera right."
            )
        return found

    @cached_property
    def _cv(self) -> Any:
        dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, dictionary)

    def _detected(self, gray: UInt8[np.ndarray, "h w"]) -> "FoundCorners | None":
        pixels, ids, _, _ = cv2.aruco.CharucoDetector(self._cv).detectBoard(gray)
        if ids is None or len(ids) < _LEAST_CORNERS:
            return None
        return FoundCorners(
            np.asarray(ids).ravel().astype(np.int64), np.asarray(pixels, float).reshape(-1, 2)
        )


@dataclass(frozen=True)
class FoundCorners:
    """Corners of a board in one picture: their ids, and column and row."""

    ids: Int64[np.ndarray, "n"]
    pixels: Float[np.ndarray, "n 2"]
