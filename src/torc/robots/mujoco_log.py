"""MuJoCo's warnings."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

_LOG = logging.getLogger("torc.mujoco")
_NONE_HERE = ("Attaching a spec with an empty prefix", "Attach conflict when attaching")
"""Beginnings of warnings that are none here: a robot's parts keep their names, as no world is saved as XML; and a robot
file's options are not the world's."""


@contextmanager
def warnings_in_the_log() -> Iterator[None]:
    """Within, and for later steps of the simulation, warnings go to Python's log, not into a file that MuJoCo makes."""
    mujoco.set_mju_user_warning(_warn)
    with warnings.catch_warnings():
        for text in _NONE_HERE:
            warnings.filterwarnings("ignore", text)
        yield


def _warn(text: str) -> None:
    if not text.startswith(_NONE_HERE):
        _LOG.warning(text)
