"""A page that shows pictures as they come: what a camera sees, or how a scene lies."""

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
    """The board of a page that is served during the block; `task` says what the page is for.

    Raises MissingDependencyError, InputError.
    """
    check_web_libraries()
    from torc.web.app import make_camera_app
    from torc.web.frames import FrameBoard

    board = FrameBoard(task)
    with served_app(lambda token, port: make_camera_app(board, token, port), options):
        yield board


def show_next(board: "FrameBoard", look: Callable[[], LiveView]) -> None:
    """One more picture, if somebody looks at them; trouble is shown there."""
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
