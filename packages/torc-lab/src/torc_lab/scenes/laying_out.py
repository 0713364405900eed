"""A person lays a scene out again, guided by a live picture and by numbers, until it is as it was."""

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
    """A scene that was accepted.

    Attributes:
        by: because it overlaps, or by the person's word.
        overlap: as it was then.
        measured: how often it was measured.
        seconds: from the first question on.
    """

    by: Literal["overlap", "word"]
    overlap: Overlap
    threshold: float
    measured: int
    seconds: float

    def facts(self) -> dict[str, Any]:
        """As it stands in result.json."""
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
    """What the camera sees of a scene, measured; for several threads."""

    lab: Lab
    scene: Scene
    eyes: Eyes
    threshold: float
    lock: threading.Lock = field(default_factory=threading.Lock)

    def measure(self) -> tuple[Overlap, dict[str, str]]:
        """How far what is there now is as it was, and what to tell of it. Raises LabError, InputError, CameraError,
        PartError.
        """
        with self.lock:
            self.eyes.look()  # it may have been on its way before anybody asked
        _, found, facts = self._look()
        return found, facts

    def picture(self) -> LiveView:
        """One look for a page. Raises what `measure` raises."""
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
    """What to tell beside the picture, by name: the objects, the worst first; `hints` say where one is instead."""
    facts = {"scene": "laid out" if found.fits(threshold) else "; ".join(found.faults(threshold))}
    for k, value in sorted(found.objects.items(), key=lambda item: item[1]):
        name = f"object {k}" + (" (the target)" if k == TARGET_ID else "")
        where = hints.get(k) or "not in its place"
        facts[name] = f"{value:.2f}" + ("" if value >= threshold else f"  {where}")
    return facts


@contextmanager
def open_eyes(lab: Lab) -> Iterator[Eyes]:
    """The lab's camera during a `with`; nothing else of it is reached. Raises InputError, CameraError."""
    camera = open_camera(lab.conditions)
    try:
        yield Eyes(lab, camera)
    finally:
        close_camera(camera)


def check_rest_pose(lab: Lab, person: Person) -> None:
    """Waits until the arm is where it does not hide the table; moves nothing. Raises LabError if it cannot be reached,
    or nobody brings it there.
    """
    arm = connect_arm(lab)
    try:
        await_rest_pose(lab, lambda: arm.status().qpos, person.ask)
    finally:
        close_arm(arm)


@contextmanager
def live_page(wanted: bool, options: PageOptions) -> Iterator["FrameBoard | None"]:
    """The page beside which a scene is laid out, if one is wanted. Raises MissingDependencyError, InputError."""
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
    """Guides the person until every object overlaps by the threshold, or the person's word; None if the person stops.

    Nothing moves: of the devices the camera is open, the arm's pose is read before. While it waits for the person, the
    board shows the live picture. Raises LabError, InputError, CameraError, PartError.
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
                person.say(f"'{answer}' is none of Enter, {_ACCEPT} and {_STOP}.")
                continue
            (found, facts), measured = view.measure(), measured + 1
            for name, fact in facts.items():
                person.say(f"  {name}: {fact}")
            if found.fits(threshold) or answer == _ACCEPT:
                by: Literal["overlap", "word"] = "overlap" if found.fits(threshold) else "word"
                return Layout(by, found, threshold, measured, time.monotonic() - began)


@contextmanager
def _shown(view: View, board: "FrameBoard | None") -> Iterator[View]:
    """Shows it on a page during the `with`, while somebody looks there."""
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
