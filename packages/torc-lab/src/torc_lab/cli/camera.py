"""`torc camera`: real cameras: what there is, what they see, and frames of it for `torc decide`."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from torc import Conditions, InputError
from torc.cli.commands import Group
from torc.cli.options import check_picture_name
from torc.cli.pages import PageOptions, check_web_libraries
from torc.cli.printing import print_json, printable, tell
from torc.registry.settings import Settings
from torc.specs.conditions import DEFAULT_WORKSPACE

if TYPE_CHECKING:
    from torc import Observation
    from torc.brain.seeing import Sight

_WIDEST_PX = 1920
_NAME = "frame_{:04d}"


@dataclass(frozen=True)
class CameraOptions:
    """The camera and what is made of its pictures. Settings: --camera.SETTING VALUE, e.g. --camera.serial 0123456789;
    docs/cameras.md lists them. Likewise --depth.SETTING and --perception.SETTING.
    """

    camera: str
    """Camera; `torc camera list` also says what is connected."""
    depth: str = "as-measured"
    """Depth: where the depth image comes from."""
    perception: str = "embedded"
    """Perception: what finds the objects."""
    workspace: str = DEFAULT_WORKSPACE
    """Whose camera pose counts with --camera.pose workspace: paper, or your own workspace file."""
    settings: Settings = field(default_factory=dict)
    """Settings of the stages, by dotted path."""

    def conditions(self) -> Conditions:
        """Return the options as conditions, to build the stages from."""
        return Conditions(
            camera=self.camera,
            depth=self.depth,
            perception=self.perception,
            workspace=self.workspace,
            settings=self.settings,
        )

    @contextmanager
    def opened(self) -> Iterator[Any]:
        """Open the camera, and close it at the end of the block. Raises InputError."""
        from torc.registry.kinds import CAMERAS
        from torc_lab.cameras.kinds import open_camera

        camera = open_camera(self.conditions())
        try:
            yield camera
        finally:
            CAMERAS.traits(camera).close()


@dataclass(frozen=True)
class ListCommand:
    """List the kinds of cameras, the libraries that are missing, and the devices that were found."""

    json: Annotated[bool, tyro.conf.arg(help="Print as JSON.")] = False

    def run(self) -> int:
        """Print the list; return the exit code."""
        from torc_lab.cameras.kinds import camera_kinds

        kinds = camera_kinds()
        if self.json:
            print_json([asdict(kind) for kind in kinds])
            return 0
        width = max(len(kind.name) for kind in kinds)
        for kind in kinds:
            print(f"{kind.name:<{width}}  {kind.what}")
            lines = [f"found: {device}" for device in kind.devices or ()]
            if kind.missing:
                lines = [kind.missing]
            elif kind.devices == ():
                lines = ["no device found"]
            for line in lines:
                print(f"{'':<{width}}    {printable(line)}")
        print(
            "\nSee through one with `torc camera show --camera NAME`; docs/cameras.md has the settings of each."
        )
        return 0


@dataclass(frozen=True)
class ShowCommand:
    """Show what a camera sees: colour, depth, and the objects that are found, side by side. What the camera does not
    see is hatched: there is no reading of depth, and torc takes the space behind for unknown.

    With --out FILE one picture is written. Without it a page shows them live, to this machine only; Ctrl-C ends it.
    """

    camera: CameraOptions
    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write one picture (PNG) and end."""
    page: PageOptions = field(default_factory=PageOptions)

    def run(self) -> int:
        """Look once, or until Ctrl-C; return the exit code."""
        if self.out is None:
            check_web_libraries()
            return self._live()
        check_picture_name(self.out, ".png")
        from torc.io.pictures import write_png
        from torc_lab.cameras.picture import snapshot_picture

        with self.camera.opened() as camera:
            sight = self._see(camera)
        self.out.parent.mkdir(parents=True, exist_ok=True)
        write_png(self.out, snapshot_picture(sight.observation, sight.scene))
        for name, fact in sight.facts().items():
            print(f"{name}: {fact}")
        print(f"{self.out}: colour, depth, masks; hatched where there is no depth")
        return 0

    def _see(self, camera: Any) -> Sight:
        """Return what the camera sees, even if its pose cannot be estimated, so that it can be turned."""
        from torc.brain.seeing import Sight, measured, see
        from torc.perception.checked_scenes import ask_camera
        from torc.registry.kinds import CAMERAS

        conditions = self.camera.conditions()
        try:
            observation = ask_camera(camera)
        except InputError as error:
            unplaced = CAMERAS.traits(camera).unplaced
            if unplaced is None:
                raise
            return Sight(measured(unplaced(), conditions), None, None, str(error), placed=False)
        return see(observation, conditions)

    def _live(self) -> int:
        from torc_lab.cameras.picture import snapshot_picture
        from torc_lab.screen import LiveView, picture_page, show_next

        def look() -> LiveView:
            sight = self._see(camera)
            return snapshot_picture(sight.observation, sight.scene, _WIDEST_PX), sight.facts()

        with self.camera.opened() as camera:
            look()  # errors in the options come before anything is served
            with suppress(KeyboardInterrupt), picture_page(self.page) as board:
                while True:
                    show_next(board, look)
        print()
        return 0


@dataclass(frozen=True)
class RecordCommand:
    """Write what a camera sees as frames: directories with rgb.png, depth.png and frame.json, without masks, which
    `torc decide` reads and the camera `recorded` plays again. A stereo pair is written too.

      torc camera record --camera realsense --out frames
      torc decide frames/frame_0001

    --camera.pose says where the camera is; if its pose is estimated (level, the default), the frame says so. Existing
    frames are kept: numbering continues.
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
        """Write the frames and print a line for each; return the exit code."""
        from torc.brain.seeing import measured
        from torc.perception.checked_scenes import ask_camera
        from torc.pipeline.frames import save_observation

        if self.count < 1 or self.every < 0:
            raise InputError("--count must be at least 1, --every at least 0.")
        names = [p.name for p in self.out.iterdir()] if self.out.is_dir() else []
        numbers = [int(found[1]) for name in names if (found := re.fullmatch(r"frame_(\d+)", name))]
        first = max(numbers, default=0) + 1
        with self.camera.opened() as camera:
            for k in range(self.count):
                if k:
                    time.sleep(self.every)
                observation = measured(ask_camera(camera).observation, self.camera.conditions())
                path = self.out / _NAME.format(first + k)
                save_observation(path, observation, self.description)
                print(f"{path}: {_told(observation)}", flush=True)
        return 0


def _told(observation: Observation) -> str:
    """Return a line about a frame; warn on stderr if `torc decide` will refuse it."""
    from torc.brain.seeing import Sight
    from torc.pipeline.frames import frame_of

    try:
        frame_of(observation)
    except InputError as error:
        tell(f"torc: `torc decide` will refuse this frame. {error}")
    facts = Sight(observation, None, None).facts()
    return f"{facts['picture']}; depth {facts['depth']}; camera {facts['camera']}"


CAMERA = Group(
    "Real cameras: what there is, what they see, and frames of it for `torc decide`.",
    {
        "list": ("kinds of cameras, missing libraries, connected devices", ListCommand),
        "show": ("what a camera sees: colour, depth, masks, what it does not see", ShowCommand),
        "record": ("frames for `torc decide`, or to play again", RecordCommand),
    },
    "Try:\n"
    "  torc camera list\n"
    "  torc camera show --camera realsense --out seen.png\n"
    "  torc camera record --camera realsense --out frames\n"
    "  torc decide frames/frame_0001",
)
