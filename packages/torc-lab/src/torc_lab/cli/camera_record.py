"""`torc camera record`: what a camera sees as frames on disk."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from torc import InputError
from torc.cli.printing import tell
from torc_lab.cli.camera_options import CameraOptions, opened, snapshot

if TYPE_CHECKING:
    from torc import Observation

_NAME = "frame_{:04d}"


@dataclass(frozen=True)
class RecordCommand:
    """Write what a camera sees as frames: directories with rgb.png, depth.png and frame.json, without masks, which
    `torc decide` reads and the camera `recorded` plays again. A stereo pair is written too.

      torc camera record --camera realsense --out frames
      torc decide frames/frame_0001

    Where the camera is says --camera.pose; if it is estimated (level, the default), the frame says so. Frames that are
    there already stay: numbers go on.
    """

    camera: CameraOptions
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Directory for the frames."""
    count: int = 1
    """How many."""
    every: float = 0.0
    """Seconds from one to the next."""
    description: str = ""
    """The target in words, for planners that ask a model; stored in each frame."""

    def run(self) -> int:
        """Write them, a line for each."""
        from torc.brain.seeing import measured
        from torc.pipeline.frames import save_observation

        if self.count < 1 or self.every < 0:
            raise InputError("--count must be at least 1, --every at least 0.")
        conditions, number = self.camera.conditions(), _last_number(self.out)
        with opened(conditions) as camera:
            for k in range(self.count):
                if k:
                    time.sleep(self.every)
                observation = measured(snapshot(camera).observation, conditions)
                path = self.out / _NAME.format(number + 1 + k)
                save_observation(path, observation, self.description)
                print(f"{path}: {_told(observation)}", flush=True)
        return 0


def _told(observation: Observation) -> str:
    """A line about a frame; what `torc decide` will say of it goes to stderr if it is a complaint."""
    from torc.brain.seeing import Sight
    from torc.pipeline.frames import frame_of

    try:
        frame_of(observation)
    except InputError as error:
        tell(f"torc: `torc decide` will refuse this frame. {error}")
    facts = Sight(observation, None, None).facts()
    return f"{facts['picture']}; depth {facts['depth']}; camera {facts['camera']}"


def _last_number(directory: Path) -> int:
    """Of the frames that are there already."""
    names = [p.name for p in directory.iterdir()] if directory.is_dir() else []
    return max((int(found[1]) for n in names if (found := re.fullmatch(r"frame_(\d+)", n))), default=0)
