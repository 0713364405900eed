"""The camera `recorded`: plays frames again, as `torc camera record` wrote them, or any that torc reads."""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from torc.errors import CameraError, InputError
from torc.pipeline.frames import load_capture
from torc.records import Capture, Observation
from torc.registry.kinds import CameraTraits


@dataclass(frozen=True)
class RecordedConfig:
    """Recorded frames.

    Attributes:
        path: a directory with frames in it (directories and .npz files, played by name, frame_2 before frame_10), or
            one frame.
        at_end: what comes after the last frame: `stay` (that one, again and again) or `raise` (a CameraError).
    """

    path: str = ""
    at_end: Literal["stay", "raise"] = "stay"


class RecordedCamera(CameraTraits):
    """Returns one frame after another, with its stored pose, or an estimated one, and with its masks if it has any."""

    real = True

    def __init__(self, config: RecordedConfig | None = None) -> None:
        self.config = RecordedConfig() if config is None else config
        self._next = 0

    @cached_property
    def _frames(self) -> list[Path]:
        return find_frames(self.config.path)

    def capture(self, *, level: bool = True) -> Capture:
        """Return the next frame; `stamp_s` is its number, from 0.

        Without `level` a missing pose is the identity, not estimated.

        Raises:
            CameraError: all frames were played, and `at_end` is "raise".
            InputError: no frame is found, one cannot be read, or its pose cannot be estimated.
        """
        if self._next >= len(self._frames) and self.config.at_end == "raise":
            raise CameraError(
                f"All {len(self._frames)} frames of '{self.config.path}' were played. --camera.at-end stay repeats the "
                "last one."
            )
        number = min(self._next, len(self._frames) - 1)
        capture = load_capture(self._frames[number], level=level)
        self._next += 1
        return replace(capture, observation=replace(capture.observation, stamp_s=float(number)))

    def unplaced(self) -> Observation:
        """Return the next frame, with the identity for a missing pose."""
        return self.capture(level=False).observation

    def close(self) -> None:
        """Begin again with the first frame."""
        self.__dict__.pop("_frames", None)
        self._next = 0


def find_frames(path: str) -> list[Path]:
    """Return the frames at a path, in order. Raises InputError if it holds none."""
    root = Path(path).expanduser()
    if not path or not root.exists():
        raise InputError(
            f"There are no recorded frames at '{path}'. Give --camera.path a directory that `torc camera record` wrote."
        )
    if _is_frame(root):
        return [root]
    found = sorted(filter(_is_frame, root.iterdir() if root.is_dir() else ()), key=_by_number)
    if not found:
        raise InputError(
            f"'{root}' holds no frames: directories with frame.json, rgb.png and depth.png, or .npz files. "
            "`torc camera record` writes them."
        )
    return found


def _is_frame(path: Path) -> bool:
    return (path / "frame.json").is_file() or (path.suffix == ".npz" and path.is_file())


def _by_number(path: Path) -> list[tuple[int, str]]:
    """Numbers in names count as numbers."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]
