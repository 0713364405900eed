"""Writing a video file frame by frame: H.264 that plays in browsers."""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from jaxtyping import UInt8

from torc.sim.closing import Closing


class Mp4Writer(Closing):
    """Use it in a `with`: the file is complete when it is closed."""

    def __init__(
        self, path: Path, width: int, height: int, fps: Fraction, options: Mapping[str, str] | None = None
    ) -> None:
        """options: of the encoder, e.g. crf."""
        self._container = av.open(str(path), "w", options={"movflags": "faststart"})
        self._stream = self._container.add_stream("h264", rate=fps, options=dict(options or {}))
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        self._stream.time_base = 1 / fps

    def write(self, rgb: UInt8[np.ndarray, "h w 3"], repeats: int = 1) -> None:
        """The next frame, or the next few of a still picture."""
        frame = av.VideoFrame.from_ndarray(rgb, format="rgb24")
        for _ in range(repeats):
            for packet in self._stream.encode(frame):
                self._container.mux(packet)

    def close(self) -> None:
        """Writes what is left."""
        for packet in self._stream.encode():
            self._container.mux(packet)
        self._container.close()
