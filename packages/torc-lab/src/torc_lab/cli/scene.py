"""`torc lab scene`: store a scene, and lay it out again."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from torc.cli.options import wanted_of
from torc.cli.pages import PageOptions


@dataclass(frozen=True)
class SceneCommand:
    """Store the scene that lies before the camera, or lay one out again that was stored. Nothing moves.

      torc lab scene scenes/mugs --reference mug.png   # stores what lies there now
      torc lab scene scenes/mugs --page                # lays it out again

    Laid out again, each object has a number from 0 to 1: how far it overlaps with where it was. With --page a picture
    in the browser shows live where everything has to be; without it, the terminal prints the numbers.

    Exit code 0 when the scene was stored or laid out, 1 when you stopped before, 2 on bad arguments.
    """

    scene: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR")]
    """Directory of the scene; its name is the scene's."""
    lab: Path = Path("lab.yaml")
    """The lab file."""
    target: str = ""
    """To store: the target in words."""
    reference: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="PICTURE...")] = ()
    """To store: pictures of the target from some sides."""
    target_size: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="LENGTH THICKNESS")] = None
    """To store: how long the target is, corner to corner, and the width of the narrowest tube it goes through, in
    metres."""
    mark: str = ""
    """To store: the target in the first picture, as COLUMN,ROW or LEFT,TOP,RIGHT,BOTTOM in pixels."""
    threshold: float = 0.8
    """To lay out: least overlap of every object."""
    page: bool = False
    """To lay out: show the live picture in a browser, too."""
    overwrite: bool = False
    """Replace a stored scene."""
    page_options: PageOptions = field(default_factory=PageOptions)

    def run(self) -> int:
        """Store the scene, or lay it out; return the exit code."""
        from torc import InputError
        from torc_lab.scenes.scene import is_scene

        told = bool(self.target or self.reference or self.mark or self.target_size)
        if is_scene(self.scene) and not self.overwrite:
            if told:
                raise InputError(
                    f"'{self.scene}' is stored already. Leave --target, --target-size, --reference and --mark "
                    "out to lay it out, or add --overwrite to store it anew."
                )
            return self._lay_out()
        return self._store()

    def _store(self) -> int:
        from torc_lab.lab_file import load_lab
        from torc_lab.person import Person, say_in_terminal
        from torc_lab.scenes.laying_out import check_rest_pose, open_eyes
        from torc_lab.scenes.overlap import measure_overlap
        from torc_lab.scenes.scene import SEEN, check_scene_place, record_scene, save_scene

        wanted = wanted_of(self.target, self.reference, self.mark, self.target_size)
        check_scene_place(self.scene, self.overwrite)
        lab = load_lab(self.lab)
        check_rest_pose(lab, Person())
        with open_eyes(lab) as eyes:
            scene, found = record_scene(self.scene.name, lab, wanted, eyes)
            again = measure_overlap(scene.reference, eyes.look(), lab.workspace.grid)
        save_scene(scene, self.scene, self.overwrite, found)
        sight = "in sight" if scene.target_in_sight else "not in sight"
        say_in_terminal(
            f"{len(scene.ids)} objects; the target is {sight}. {self.scene / SEEN} has their numbers."
        )
        for fault in again.faults(self.threshold):
            say_in_terminal(
                f"Nothing moved, and yet: {fault}. Such an object cannot be judged at {self.threshold:g}."
            )
        return 0

    def _lay_out(self) -> int:
        from torc_lab.lab_file import load_lab
        from torc_lab.person import Person
        from torc_lab.scenes.laying_out import lay_out, live_page
        from torc_lab.scenes.scene import load_scene

        lab, scene = load_lab(self.lab), load_scene(self.scene)
        with live_page(self.page, self.page_options) as board:
            layout = lay_out(lab, scene, Person(), self.threshold, board)
        return 1 if layout is None else 0
