"""The page beside which a person lays a scene out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from torc.cli.pages import PageOptions, check_web_libraries, served_app

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import UInt8

    from torc.web.camera_page import CameraBoard
    from torc_lab.scenes.laying_out import Screen

_TASK = (
    "Lay the scene out: green is in its place, orange nearly, red not; there the reference shines through. When all is "
    "green, go on in the terminal."
)


class _Page:
    """`Screen` of torc_lab.scenes.laying_out on the page of `torc camera show`."""

    def __init__(self, board: CameraBoard) -> None:
        self._board = board

    @property
    def watched(self) -> bool:
        return self._board.watched

    def show(self, rgb: UInt8[np.ndarray, "h w 3"], facts: dict[str, str]) -> None:
        from torc.web.frames import jpeg

        self._board.show(jpeg(rgb), facts)

    def trouble(self, text: str) -> None:
        self._board.trouble(text)


@contextmanager
def page_screen(wanted: bool, options: PageOptions) -> Iterator[Screen | None]:
    """A page during the block, if one is wanted; None for the terminal alone. Raises MissingDependencyError,
    InputError.
    """
    if not wanted:
        yield None
        return
    check_web_libraries()
    from torc.web.camera_page import CameraBoard, make_camera_app

    board = CameraBoard(_TASK)
    with served_app(lambda token, port: make_camera_app(board, token, port), options):
        yield _Page(board)
