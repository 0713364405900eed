"""What is in a robot's files, as a digest: two robots that are alike in it are the same, wherever the files lie."""

import hashlib
from typing import Any

import numpy as np

from torc.fingerprints import fingerprint
from torc.robots.schema import RobotFile

_WHERE = ("paths", "npaths", "nbuffer")
"""Of a compiled model, what follows from where the files of its meshes and textures lie."""


def robot_source(description: RobotFile, model: Any) -> str:
    """Fingerprint of a robot file, and of all that its MJCF pulls in: included files, meshes, textures.

    Comments and the names of files do not count.

    Args:
        description: the robot file.
        model: the MjModel compiled from its MJCF.
    """
    digest = hashlib.sha256()
    _take(digest, "", model)
    return fingerprint(
        {"description": description.model_dump(mode="json", exclude={"mjcf"}), "model": digest.hexdigest()}
    )


def _take(digest: Any, name: str, value: Any) -> None:
    """Take in a number, an array, bytes, or a part of a model with all that is in it."""
    if isinstance(value, (bytes, int, float, np.ndarray)):
        content = value if isinstance(value, bytes) else np.ascontiguousarray(value).tobytes()
        digest.update(f"{name}:{len(content)}:".encode() + content)
    elif not callable(value):
        for inner in sorted(vars(type(value))):
            if not inner.startswith("_") and inner not in _WHERE and not inner.endswith("_pathadr"):
                _take(digest, f"{name}.{inner}", getattr(value, inner))
