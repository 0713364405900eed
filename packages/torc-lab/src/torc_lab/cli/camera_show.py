"""`torc camera show`: what a camera sees, in a local page or as a picture."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from torc.cli.options import check_picture_name
from torc.cli.pages import PageOptions, check_web_libraries, served_app
from torc_lab.cli.camera_options import CameraOptions, opened, snapshot

if TYPE_CHECKING:
    from torc.brain.seeing import Sight
    from torc.web.camera_page import CameraBoard

_WIDEST_PX = 1920
_IDLE_S, _AFTER_TROUBLE_S = 0.1, 1.0


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
        """Look once, or until Ctrl-C."""
        if self.out is None:
            check_web_libraries()
            return self._live()
        check_picture_name(self.out, ".png")
        from torc.io.pictures import write_png
        from torc_lab.cameras.picture import snapshot_picture

        with opened(self.camera.conditions()) as camera:
            sight = self._see(camera)
        self.out.parent.mkdir(parents=True, exist_ok=True)
        write_png(self.out, snapshot_picture(sight.observation, sight.scene))
        for name, fact in sight.facts().items():
            print(f"{name}: {fact}")
        print(f"{self.out}: colour, depth, masks; hatched where there is no depth")
        return 0

    def _see(self, camera: object) -> Sight:
        """What is seen, also where the camera's pose cannot be estimated: then it has to be turned."""
        from torc import InputError
        from torc.brain.seeing import Sight, measured, see
        from torc.registry.kinds import CAMERAS

        conditions = self.camera.conditions()
        try:
            observation = snapshot(camera)
        except InputError as error:
            unplaced = CAMERAS.traits(camera).unplaced
            if unplaced is None:
                raise
            return Sight(measured(unplaced(), conditions), None, None, str(error), placed=False)
        return see(observation, conditions)

    def _live(self) -> int:
        from torc.web.camera_page import CameraBoard, make_camera_app

        board = CameraBoard()
        with opened(self.camera.conditions()) as camera:
            board.show(
                *self._told(camera)
            )  # what is wrong with the options is told before anything is served
            try:
                with served_app(lambda token, port: make_camera_app(board, token, port), self.page):
                    while True:
                        self._watch(board, camera)
            except KeyboardInterrupt:
                print()
        return 0

    def _watch(self, board: CameraBoard, camera: object) -> None:
        """One more picture, if somebody looks at them; trouble is shown there, and tried again."""
        from torc import InputError
        from torc.errors import CameraError

        if not board.watched:
            time.sleep(_IDLE_S)
            return
        try:
            board.show(*self._told(camera))
        except (CameraError, InputError) as error:
            board.trouble(str(error))
            time.sleep(_AFTER_TROUBLE_S)

    def _told(self, camera: object) -> tuple[bytes, dict[str, str]]:
        """The picture as JPEG, and the facts."""
        from torc.web.frames import jpeg
        from torc_lab.cameras.picture import snapshot_picture

        sight = self._see(camera)
        return jpeg(snapshot_picture(sight.observation, sight.scene, _WIDEST_PX)), sight.facts()
