"""Keep a trial while it is played: its log in memory, or a directory with log, pictures and result."""

import json
import os
import shutil
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from torc.drawing.belief_picture import draw_belief
from torc.drawing.graph_picture import draw_decision
from torc.drawing.marking import mark_image
from torc.drawing.strip import Crop, Frame, crop_around_objects, picture_strip
from torc.episode.events import Decided, Event, Executed, Looked
from torc.errors import InputError
from torc.io.pictures import write_png
from torc.io.record_files import save_record
from torc.io.results import check_place, claim, write_json
from torc.records.evidence import ModelTry
from torc.trials.log import EventLine, TrialResult, line_of
from torc.trials.pick_view import view_of
from torc.trials.recorded import BELIEF, LOG, PLAIN, SEEN, sent_name
from torc.trials.viewer_links import PARTIAL
from torc.trials.vlm_use import vlm_use
from torc.vlm.config import VlmConfig


class TrialLog:
    """Keeps the log of one trial in memory. It is one of the trial's listeners.

    Attributes:
        lines: the log so far.
        asked: the model that the planner asks, set by whoever plays the trial.
        directory: where the trial is on disk now; None if nothing is written.
    """

    def __init__(self) -> None:
        self.lines: list[EventLine] = []
        self.asked: VlmConfig | None = None
        self.directory: Path | None = None
        self._tries: list[ModelTry] = []

    @property
    def vlm_facts(self) -> dict[str, Any]:
        """What the model has used so far, for the result; empty if no model is asked."""
        return {} if self.asked is None else {"vlm_use": vlm_use(self._tries, self.asked.prices)}

    def __call__(self, event: Event) -> None:
        """Record one event."""
        self.lines.append(line_of(event))
        if isinstance(event, Decided) and event.decision.evidence.vlm is not None:
            self._tries += event.decision.evidence.vlm.tries

    def note_error(self, traceback: str) -> None:
        """Keep the traceback of what broke the trial."""

    def complete(self, result: TrialResult) -> None:
        """Note that the trial is over."""

    def write_result(self, result: TrialResult) -> None:
        """Note that the trial was interrupted."""

    def discard(self) -> None:
        """Note that nothing was run."""


class TrialRecorder(TrialLog):
    """Writes events, pictures and the result of one trial while it happens, to a directory. Present = complete.

    Until `complete` the files stand in `<out>.partial`: after a crash or Ctrl-C that directory is readable. spec.json
    is written at once. With `pictures`, what the planner saw at each pick is written, too; with `snapshots`, each one
    is also saved as a record (about 1 MB a pick). Raises InputError if the directory exists (and not overwrite), is not
    a trial, cannot be written, or another process is writing it.
    """

    def __init__(
        self,
        out: Path,
        spec: dict[str, Any],
        *,
        overwrite: bool = False,
        pictures: bool = True,
        snapshots: bool = False,
    ) -> None:
        super().__init__()
        check_place(out, overwrite, LOG, "trial")
        self.out, self.partial = out, out.with_name(out.name + PARTIAL)
        self.pictures, self.snapshots = pictures, snapshots
        self.frames: list[Frame] = []
        self._crop: Crop | None = None
        self._new = [parent for parent in out.parents if not parent.exists()]
        self._log = claim(self.partial, LOG, "trial")
        self.directory = self.partial
        try:
            (self.partial / "picks").mkdir()
            write_json(self.partial / "spec.json", spec)
        except OSError as error:
            raise InputError(
                f"Cannot write to '{self.partial}': {error.strerror}. Choose another --out."
            ) from error

    def __call__(self, event: Event) -> None:
        """Record one event and flush its line, so that a crash loses nothing."""
        super().__call__(event)
        self._log.write(json.dumps(self.lines[-1].plain) + "\n")
        self._log.flush()
        if self.pictures:
            self._draw(event)
        match event:
            case Looked() if self.snapshots:
                save_record(event.look.captures[0], self._pick_path(event.pick, "observation.npz"))
            case Decided():
                for number, picture in enumerate(event.decision.pictures):
                    self._pick_path(event.pick, sent_name(number)).write_bytes(picture)

    def _draw(self, event: Event) -> None:
        match event:
            case Looked():
                scene = event.look.context.scene
                self._crop = self._crop or crop_around_objects(scene.label_image)
                write_png(self._pick_path(event.pick, SEEN), mark_image(scene))
                write_png(self._pick_path(event.pick, PLAIN), scene.observation.rgb)
                save_record(view_of(event.look.context), self._pick_path(event.pick, "view.npz"))
            case Decided():
                scene, decision = event.look.context.scene, event.decision
                # The planner may name an object that is not there; the choice is judged later.
                chosen = decision.object_id if decision.object_id in scene.ids else None
                cropped = mark_image(scene, highlight=chosen)[self._crop or ...]
                self.frames.append(Frame(event.pick, cropped, chosen, decision.reason))
                if (graph := draw_decision(decision)) is not None:
                    write_png(self._pick_path(event.pick, "graph.png"), graph)
                if (belief := draw_belief(decision, scene)) is not None:
                    write_png(self._pick_path(event.pick, BELIEF), belief)
            case Executed():
                if self.frames and self.frames[-1].pick == event.pick:
                    self.frames[-1] = replace(self.frames[-1], outcome=event.outcome)

    def note_error(self, traceback: str) -> None:
        """Write error.txt."""
        (self.partial / "error.txt").write_text(traceback, encoding="utf-8")

    def complete(self, result: TrialResult) -> None:
        """Write result.json and the picture strip, then rename the directory to its final name."""
        self._write(result)
        backup = self.out.with_name(self.out.name + ".replaced")
        if self.out.exists():
            shutil.rmtree(backup, ignore_errors=True)
            os.replace(self.out, backup)
        os.replace(self.partial, self.out)
        self.directory = self.out
        self._log.close()  # which ends the claim to the directory
        shutil.rmtree(backup, ignore_errors=True)

    def discard(self) -> None:
        """Remove what was begun, with the directories made for it: nothing was run."""
        self._log.close()
        shutil.rmtree(self.partial, ignore_errors=True)
        for parent in self._new:
            with suppress(OSError):  # another process may have put something there
                parent.rmdir()

    def write_result(self, result: TrialResult) -> None:
        """Write what exists, leaving the directory partial (an interrupted trial)."""
        self._write(result)
        self._log.close()

    def _write(self, result: TrialResult) -> None:
        if self.frames:
            write_png(self.partial / "strip.png", picture_strip(self.frames))
        write_json(self.partial / "result.json", result.plain)

    def _pick_path(self, pick: int, name: str) -> Path:
        return self.partial / "picks" / f"{pick:02d}_{name}"
