"""Guide a person who lays a scene out again, by a live picture and by numbers."""

import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from torc import InputError, Observation
from torc.cli.pages import PageOptions
from torc.records import TARGET_ID
from torc_lab.cameras.kinds import open_camera
from torc_lab.devices import close_arm, close_camera, connect_arm
from torc_lab.lab_file import Lab
from torc_lab.person import Person, await_rest_pose
from torc_lab.scenes.hints import hint
from torc_lab.scenes.overlap import Overlap, measure_overlap
from torc_lab.scenes.overlay import overlay
from torc_lab.scenes.scene import Eyes, Scene
from torc_lab.screen import LiveView, picture_page, show_next

if TYPE_CHECKING:
    from torc.web.frames import FrameBoard

THRESHOLD = 0.8
"""Least overlap of each object: about a centimetre of an object of usual size (docs/laboratory.md)."""
_STOP, _ACCEPT = "stop", "accept"
_TASK = (
    "Lay the scene out: green is in its place, orange nearly, red not; there the reference shines through. When all is "
    "green, go on in the terminal."
)


@dataclass(frozen=True)
class Layout:
    """How a layout of a scene was accepted.

    Attributes:
        by: "overlap" if every object reached the threshold, "word" if the person accepted it.
        overlap: the last measurement.
        measured: number of measurements.
        seconds: time taken, from the start to acceptance.
    """

    by: Literal["overlap", "word"]
    overlap: Overlap
    threshold: float
    measured: int
    seconds: float

    def facts(self) -> dict[str, Any]:
        """Return the entry for result.json."""
        return {
            "accepted_by": self.by,
            "threshold": self.threshold,
            "overlap": {str(k): round(value, 3) for k, value in self.overlap.objects.items()},
            "faults": self.overlap.faults(self.threshold),
            "measured": self.measured,
            "seconds": round(self.seconds, 1),
        }


@dataclass(frozen=True)
class View:
    """Measures what the camera sees of a scene; safe to use from several threads."""

    lab: Lab
    scene: Scene
    eyes: Eyes
    threshold: float
    lock: threading.Lock = field(default_factory=threading.Lock)

    def measure(self) -> tuple[Overlap, dict[str, str]]:
        """Return the overlap now, and facts to show about it, by name. Raises LabError, InputError, CameraError or
        PartError.
        """
        with self.lock:
            self.eyes.look()  # it may have been on its way before anybody asked
        _, found, facts = self._look()
        return found, facts

    def picture(self) -> LiveView:
        """Return a picture and facts for a page. Raises the same errors as `measure`."""
        seen, found, facts = self._look()
        return overlay(self.scene.reference, seen, found, self.threshold), facts

    def _look(self) -> tuple[Observation, Overlap, dict[str, str]]:
        with self.lock:
            seen = self.eyes.look()
        reference = self.scene.reference
        found = measure_overlap(reference, seen, self.lab.workspace.grid)
        off = [k for k, value in found.objects.items() if value < self.threshold]
        return seen, found, told(found, self.threshold, {k: hint(reference, seen, k) for k in off})


def told(found: Overlap, threshold: float, hints: Mapping[int, str]) -> dict[str, str]:
    """Return facts to show beside the picture, by name: the objects, worst first; `hints`: where misplaced ones are."""
    facts = {"scene": "laid out" if found.fits(threshold) else "; ".join(found.faults(threshold))}
    for k, value in sorted(found.objects.items(), key=lambda item: item[1]):
        name = f"object {k}" + (" (the target)" if k == TARGET_ID else "")
        where = hints.get(k) or "not in its place"
        facts[name] = f"{value:.2f}" + ("" if value >= threshold else f"  {where}")
    return facts


@contextmanager
def open_eyes(lab: Lab) -> Iterator[Eyes]:
    """Open the lab's camera, and no other device, during a `with`. Raises InputError or CameraError."""
    camera = open_camera(lab.conditions)
    try:
        yield Eyes(lab, camera)
    finally:
        close_camera(camera)


def check_rest_pose(lab: Lab, person: Person) -> None:
    """Wait until the arm is at its rest pose, where it does not hide the table; move nothing.

    Raises LabError if the arm cannot be reached, or the person does not bring it there.
    """
    arm = connect_arm(lab)
    try:
        await_rest_pose(lab, lambda: arm.status().qpos, person.ask)
    finally:
        close_arm(arm)


@contextmanager
def live_page(wanted: bool, options: PageOptions) -> Iterator["FrameBoard | None"]:
    """Serve the page for laying a scene out, if wanted. Raises MissingDependencyError or InputError."""
    if not wanted:
        yield None
        return
    with picture_page(options, _TASK) as board:
        yield board


def lay_out(
    lab: Lab,
    scene: Scene,
    person: Person,
    threshold: float = THRESHOLD,
    board: "FrameBoard | None" = None,
) -> Layout | None:
    """Guide the person until every object overlaps by the threshold, or the person accepts; None if the person stops.

    Nothing moves: only the arm's pose is read first, then only the camera is open. While it waits for the person, the
    board shows the live picture.

    Args:
        threshold: least overlap of every object, above 0 and at most 1.
        board: shows the live picture; None for no page.

    Raises:
        LabError, InputError, CameraError, PartError: as the devices and stages raise them.
    """
    if not 0 < threshold <= 1:
        raise InputError(f"The threshold of the overlap is above 0 and at most 1, not {threshold}.")
    began, measured = time.monotonic(), 0
    check_rest_pose(lab, person)
    question = f"Lay out '{scene.name}'. Enter: measure; {_ACCEPT}: take it as it is; {_STOP}: end."
    with open_eyes(lab) as eyes, _shown(View(lab, scene, eyes, threshold), board) as view:
        while True:
            answer = person.ask_text(question).strip().lower()
            if answer == _STOP:
                return None
            if answer not in ("", _ACCEPT):
                person.say(f"'{answer}' is not one of Enter, {_ACCEPT} and {_STOP}.")
                continue
            (found, facts), measured = view.measure(), measured + 1
            for name, fact in facts.items():
                person.say(f"  {name}: {fact}")
            if found.fits(threshold) or answer == _ACCEPT:
                by: Literal["overlap", "word"] = "overlap" if found.fits(threshold) else "word"
                return Layout(by, found, threshold, measured, time.monotonic() - began)


@contextmanager
def _shown(view: View, board: "FrameBoard | None") -> Iterator[View]:
    """Show the view on a board during the `with`, while a browser watches it."""
    if board is None:
        yield view
        return
    ending = threading.Event()

    def show() -> None:
        while not ending.is_set():
            show_next(board, view.picture)

    thread = threading.Thread(target=show, name="torc-layout", daemon=True)
    thread.start()
    try:
        yield view
    finally:
        ending.set()
        thread.join()
        board.trouble("The scene is not being laid out now.")
