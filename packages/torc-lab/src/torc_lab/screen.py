"""Serve a page with live pictures: what a camera sees, or how a scene is laid out."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import UInt8

from torc import TorcError
from torc.cli.pages import PageOptions, check_web_libraries, served_app

if TYPE_CHECKING:
    from torc.web.frames import FrameBoard

LiveView = tuple[UInt8[np.ndarray, "h w 3"], dict[str, str]]
"""A picture, and facts by name."""
_IDLE_S, _AFTER_TROUBLE_S = 0.1, 1.0


@contextmanager
def picture_page(options: PageOptions, task: str = "") -> Iterator["FrameBoard"]:
    """Serve a page during the block and yield its board; `task` says what the page is for.

    Raises MissingDependencyError or InputError.
    """
    check_web_libraries()
    from torc.web.app import make_camera_app
    from torc.web.frames import FrameBoard

    board = FrameBoard(task)
    with served_app(lambda token, port: make_camera_app(board, token, port), options):
        yield board


def show_next(board: "FrameBoard", look: Callable[[], LiveView]) -> None:
    """Show the next picture, or the error on failure; without a viewer only wait a little."""
    from torc.web.frames import jpeg

    if not board.watched:
        time.sleep(_IDLE_S)
        return
    try:
        rgb, facts = look()
    except TorcError as error:
        board.trouble(str(error))
        time.sleep(_AFTER_TROUBLE_S)
    else:
        board.put(jpeg(rgb), facts)
