"""`torc lab`: a laboratory's devices: the file that names them, whether they work, and their twins to rehearse with."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from torc.cli.commands import Group
from torc.cli.printing import printable
from torc_lab.cli.bench import LabBenchCommand
from torc_lab.cli.calibration import BoardCommand, CalibrateCommand
from torc_lab.cli.scene import SceneCommand

if TYPE_CHECKING:
    from torc import Problem
    from torc_lab.twin.rehearsal import Rehearsal


@dataclass(frozen=True)
class ExampleCommand:
    """Print a lab file to begin with: redirect it into a file, and change the addresses.

    Without a name: list them.
    """

    name: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[NAME]")] = ""

    def run(self) -> int:
        """Print the file or the list; return the exit code."""
        from torc.errors import UnknownNameError
        from torc_lab.lab_file import example_labs

        known = example_labs()
        if not self.name:
            width = max(map(len, known))
            for name, text in known.items():
                print(f"{name:<{width}}  {text.splitlines()[0].lstrip('# ')}")
            return 0
        if self.name not in known:
            raise UnknownNameError("lab file", self.name, list(known))
        print(known[self.name], end="")
        return 0


@dataclass(frozen=True)
class CheckCommand:
    """Try every device of a lab file, and say what was found. Nothing moves without --move.

    Exit code 0 if all is well, 1 if not.
    """

    lab: tyro.conf.Positional[Path]
    """The lab file."""
    move: bool = False
    """Also power the servos, activate the gripper, and turn each joint a little; asks before each."""
    json: Annotated[bool, tyro.conf.arg(help="Print a line of JSON per finding.")] = False

    def run(self) -> int:
        """Check the devices; return the exit code."""
        from torc_lab.checking import check_lab
        from torc_lab.lab_file import load_lab
        from torc_lab.person import ask_in_terminal

        faults = 0
        for finding in check_lab(load_lab(self.lab), ask_in_terminal if self.move else None):
            faults += not finding.good
            if self.json:
                print(json.dumps({"device": finding.device, "good": finding.good, "text": finding.text}))
            else:
                print(
                    f"{'ok' if finding.good else 'FAULT':<6} {finding.device:<8} {printable(finding.text)}",
                    flush=True,
                )
        return 1 if faults else 0


@dataclass(frozen=True)
class TwinCommand:
    """Rehearse: the simulator behind the wires of a lab file, on this machine.

    Starts twins of the arm's controller, the gripper and the camera around a problem, and writes a lab file that leads
    to them. Use it in another terminal as you would use your own:

      torc lab twin unstructured-04 --lab lab.yaml --references pictures
      torc lab check twin.yaml --move
      torc retrieve --lab twin.yaml --reference pictures/*.png

    While they run, type the name of a fault to make it happen, `recover` to end it, `truth` for what really lies in the
    bin, or `reset` to lay the scene out again, for the next trial. Ctrl-C ends them.
    """

    problem: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[PROBLEM]")] = "structured-01"
    """Name of a shipped problem, or a problem file."""
    lab: Path = Path("lab.yaml")
    """Your lab file."""
    out: Path = Path("twin.yaml")
    """The lab file that leads to the twins."""
    references: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Also write reference pictures of the problem's target there, for `torc retrieve --reference DIR/*.png`."""

    def run(self) -> int:
        """Run the twins until Ctrl-C; return the exit code."""
        from torc import load_problem
        from torc_lab.lab_file import load_lab
        from torc_lab.twin.rehearsal import ACTIONS, FAULTS, rehearsal, write_lab

        problem = load_problem(self.problem)
        with rehearsal(load_lab(self.lab), problem) as there:
            write_lab(there.text, self.out)
            print(f"The twins run; {self.out} leads to them. The target is {problem.description}.")
            if self.references is not None:
                print(_write_references(problem, self.references))
            width = max(map(len, FAULTS))
            print("Type one of these, or `truth`; Ctrl-C ends the twins.")
            for name, (what, _) in {**FAULTS, **ACTIONS}.items():
                print(f"  {name:<{width}}  {what}", flush=True)
            with suppress(KeyboardInterrupt):
                _obey(there, sys.stdin)
                threading.Event().wait()  # its input ended: it runs as a service
        return 0


def _obey(there: Rehearsal, lines: Iterable[str]) -> None:
    """Carry out typed commands, one per line."""
    from torc_lab.twin.rehearsal import ACTIONS, FAULTS

    words = {**FAULTS, **ACTIONS}
    for line in lines:
        word = line.strip().lower()
        if word == "truth":
            truth = there.world.truth()
            print(
                f"In the bin: {list(truth.in_bin)}; dropped: {list(truth.dropped)}; the target has id 0.",
                flush=True,
            )
        elif word in words:
            words[word][1](there)
        elif word:
            print(f"'{printable(word)}' is not one of {', '.join([*words, 'truth'])}.", flush=True)


def _write_references(problem: Problem, directory: Path) -> str:
    from torc.episode.simulated import pictured_target
    from torc.io.pictures import write_png

    directory.mkdir(parents=True, exist_ok=True)
    wanted = pictured_target(problem)
    for number, picture in enumerate(wanted.pictures, start=1):
        write_png(directory / f"target_{number}.png", picture)
    pictures = f"{directory}/target_1.png to target_{len(wanted.pictures)}.png"
    assert wanted.size_m is not None
    return (
        f"Pictures of it: {pictures}. Its size: --target-size {wanted.size_m[0]:.3f} {wanted.size_m[1]:.3f}."
    )


LAB = Group(
    "A laboratory: real arm, gripper and camera, by one file; and twins of them to rehearse with.",
    {
        "example": ("a lab file to begin with", ExampleCommand),
        "check": ("whether every device works; moves nothing unless told", CheckCommand),
        "board": ("a board to print, for calibrating", BoardCommand),
        "calibrate": (
            "where the camera is, by a board in the robot's hand or on the table",
            CalibrateCommand,
        ),
        "scene": ("store a scene, and lay it out again", SceneCommand),
        "bench": ("task planners against each other in such scenes", LabBenchCommand),
        "twin": ("the simulator behind the same wires, to rehearse", TwinCommand),
    },
    "Try:\n"
    "  torc lab example sda10f-ros1 > lab.yaml\n"
    "  torc lab twin structured-01 --lab lab.yaml --references pictures\n"
    "  torc lab check twin.yaml --move\n"
    "  torc retrieve --lab twin.yaml --reference pictures/*.png --dry-run\n\n"
    "docs/laboratory.md leads from boxes to the first pick. No real device has been driven yet.",
)
