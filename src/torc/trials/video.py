"""Make the video of an episode: the robot from outside, with what the planner saw in a corner."""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from torc.drawing.marking import mark_image
from torc.drawing.strip import Crop, crop_around_objects
from torc.episode.events import Decided, Event, Executed, Started
from torc.geometry.transforms import look_at
from torc.sim.rendering import CameraRenderer, Closing
from torc.sim.simulated_world import World
from torc.workspace.description import CameraMount

WIDTH, HEIGHT = 800, 600
GRABS_PER_FRAME = 2
FPS = Fraction(25, GRABS_PER_FRAME)
SECOND = round(FPS)
INSET_WIDTH = 300
MOUNT = CameraMount(look_at((1.95, -1.75, 2.05), (0.42, -0.36, 1.12)), WIDTH, HEIGHT, float(np.deg2rad(45)))


class Mp4Writer(Closing):
    """Writes a video frame by frame, H.264 that plays in browsers; the file is complete once closed."""

    def __init__(
        self, path: Path, width: int, height: int, fps: Fraction, options: Mapping[str, str] | None = None
    ) -> None:
        """Open the file; `options` are the encoder's, e.g. crf."""
        self._container = av.open(str(path), "w", options={"movflags": "faststart"})
        self._stream = self._container.add_stream("h264", rate=fps, options=dict(options or {}))
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        self._stream.time_base = 1 / fps

    def write(self, rgb: UInt8[np.ndarray, "h w 3"], repeats: int = 1) -> None:
        """Write the next frame, several times for a still picture."""
        frame = av.VideoFrame.from_ndarray(rgb, format="rgb24")
        for _ in range(repeats):
            for packet in self._stream.encode(frame):
                self._container.mux(packet)

    def close(self) -> None:
        """Write the remaining packets, and close the file."""
        for packet in self._stream.encode():
            self._container.mux(packet)
        self._container.close()


class VideoRecorder(Closing):
    """Grabs a frame every other 1/25 s of simulated time; still frames show each decision."""

    def __init__(self, path: Path, world: World) -> None:
        self._renderer = CameraRenderer(world, MOUNT)
        self._video = Mp4Writer(path, WIDTH, HEIGHT, FPS)
        self._grabs = 0
        self._crop: Crop | None = None
        self._inset: np.ndarray | None = None
        self._caption = ""

    def close(self) -> None:
        """Complete the file."""
        self._video.close()
        self._renderer.close()

    def observe(self, world: World) -> None:
        """Grab a frame; the simulation calls this 25 times a simulated second. Changes no result."""
        self._grabs += 1
        if self._grabs % GRABS_PER_FRAME == 0:
            self._write(1)

    def __call__(self, event: Event) -> None:
        """Show a decision for a second, and the outcome in the caption."""
        match event:
            case Started():
                self._caption = f"{event.problem}: {event.target_description}"
                self._write(SECOND)
            case Decided():
                scene = event.look.context.scene
                self._crop = self._crop or crop_around_objects(scene.label_image)
                chosen = event.decision.object_id if event.decision.object_id in scene.ids else None
                self._inset = mark_image(scene, highlight=chosen)[self._crop]
                self._caption = f"{event.pick + 1}. {event.decision.reason}"
                self._write(SECOND)
            case Executed():
                self._caption = f"{event.pick + 1}. {event.outcome.result.value}"
                self._write(SECOND // 2)

    def _write(self, repeats: int) -> None:
        picture = self._renderer.render_color().copy()
        if self._inset is not None:
            h = round(INSET_WIDTH * self._inset.shape[0] / self._inset.shape[1])
            small = cv2.resize(self._inset, (INSET_WIDTH, h), interpolation=cv2.INTER_AREA)
            picture[8 : 8 + h, -8 - INSET_WIDTH : -8] = small
        image = Image.fromarray(picture)
        draw = ImageDraw.Draw(image)
        draw.rectangle((0, HEIGHT - 34, WIDTH, HEIGHT), fill=(25, 25, 25))
        draw.text((12, HEIGHT - 28), self._caption[:95], (245, 245, 245), ImageFont.load_default(18))
        self._video.write(np.asarray(image), repeats)
