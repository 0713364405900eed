"""A person lays a scene out again, guided by a live picture and by numbers, until it is as it was."""

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from jaxtyping import UInt8

from torc import InputError, Observation, TorcError
from torc.records import TARGET_ID
from torc_lab.cameras.kinds import open_camera
from torc_lab.devices import close_arm, close_camera, connect_arm, is_at_rest_pose
from torc_lab.lab_file import Lab
from torc_lab.person import Person
from torc_lab.protocols import LabError
from torc_lab.scenes.hints import hint
from torc_lab.scenes.overlap import Overlap, measure_overlap
from torc_lab.scenes.overlay import overlay
from torc_lab.scenes.scene import Eyes, Scene

THRESHOLD = 0.8
"""Least overlap of each object: about a centimetre of an object of usual size (docs/laboratory.md)."""
_IDLE_S, _AFTER_TROUBLE_S = 0.1, 1.0
_STOP, _ACCEPT = "stop", "accept"


class Screen(Protocol):
    """Where a live picture is shown, for instance a page in a browser."""

    @property
    def watched(self) -> bool:
        """Whether somebody looks."""

    def show(self, rgb: UInt8[np.ndarray, "h w 3"], facts: dict[str, str]) -> None:
        """The next picture, with facts by name."""

    def trouble(self, text: str) -> None:
        """Why there is no picture now."""


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


class View:
    """What the camera sees of a scene, measured; for several threads."""

    def __init__(self, lab: Lab, scene: Scene, eyes: Eyes, threshold: float) -> None:
        self._grid, self._scene, self._eyes = lab.workspace.grid, scene, eyes
        self.threshold = threshold
        self._lock = threading.Lock()

    def measure(self) -> tuple[Overlap, dict[str, str]]:
        """How far what is there now is as it was, and what to tell of it. Raises LabError, InputError, CameraError,
        PartError.
        """
        with self._lock:
            self._eyes.look()  # it may have been on its way before anybody asked
        seen, found = self._look()
        return found, self._told(seen, found)

    def show_on(self, screen: Screen) -> None:
        """One look for a screen; trouble is shown there."""
        try:
            seen, found = self._look()
        except TorcError as error:
            screen.trouble(str(error))
            time.sleep(_AFTER_TROUBLE_S)
            return
        picture = overlay(self._scene.reference, seen, found, self.threshold)
        screen.show(picture, self._told(seen, found))

    def _told(self, seen: Observation, found: Overlap) -> dict[str, str]:
        off = [k for k, value in found.objects.items() if value < self.threshold]
        return told(found, self.threshold, {k: hint(self._scene.reference, seen, k) for k in off})

    def _look(self) -> tuple[Observation, Overlap]:
        with self._lock:
            seen = self._eyes.look()
        return seen, measure_overlap(self._scene.reference, seen, self._grid)


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


def await_rest_pose(lab: Lab, person: Person) -> None:
    """Waits until the arm is where it does not hide the table; moves nothing. Raises LabError if it cannot be reached,
    or nobody brings it there.
    """
    arm = connect_arm(lab)
    try:
        while not is_at_rest_pose(lab, arm.status().qpos):
            if not person.ask(
                "The arm is not at its rest pose: it may hide the table. Bring it there. Ready?"
            ):
                raise LabError("The arm is not at its rest pose: it would hide the table from the camera.")
    finally:
        close_arm(arm)


def lay_out(
    lab: Lab,
    scene: Scene,
    person: Person,
    threshold: float = THRESHOLD,
    screen: Screen | None = None,
    say: Callable[[str], None] = print,
) -> Layout | None:
    """Guides the person until every object overlaps by the threshold, or the person's word; None if the person stops.

    Nothing moves: of the devices the camera is open, the arm's pose is read before. While it waits for the person, the
    screen shows the live picture. Raises LabError, InputError, CameraError, PartError.
    """
    if not 0 < threshold <= 1:
        raise InputError(f"The threshold of the overlap is above 0 and at most 1, not {threshold}.")
    began, measured = time.monotonic(), 0
    await_rest_pose(lab, person)
    question = f"Lay out '{scene.name}'. Enter: measure; {_ACCEPT}: take it as it is; {_STOP}: end."
    with open_eyes(lab) as eyes, _shown(View(lab, scene, eyes, threshold), screen) as view:
        while True:
            answer = person.ask_text(question).strip().lower()
            if answer == _STOP:
                return None
            if answer not in ("", _ACCEPT):
                say(f"'{answer}' is none of Enter, {_ACCEPT} and {_STOP}.")
                continue
            (found, facts), measured = view.measure(), measured + 1
            for name, fact in facts.items():
                say(f"  {name}: {fact}")
            if found.fits(threshold) or answer == _ACCEPT:
                by: Literal["overlap", "word"] = "overlap" if found.fits(threshold) else "word"
                return Layout(by, found, threshold, measured, time.monotonic() - began)


@contextmanager
def _shown(view: View, screen: Screen | None) -> Iterator[View]:
    """Shows it on a screen during the `with`, while somebody looks there."""
    if screen is None:
        yield view
        return
    ending = threading.Event()

    def show() -> None:
        while not ending.is_set():
            if screen.watched:
                view.show_on(screen)
            else:
                ending.wait(_IDLE_S)

    thread = threading.Thread(target=show, name="torc-layout", daemon=True)
    thread.start()
    try:
        yield view
    finally:
        ending.set()
        thread.join()
        with suppress(TorcError):
            screen.trouble("The scene is not being laid out now.")
