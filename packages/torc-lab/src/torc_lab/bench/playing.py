"""Plays what is left of a comparison on a real robot, with a person who lays out, confirms and tells."""

import json
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from torc import InputError, TorcError
from torc.benchmark.spec import BenchSpec, PlannedTrial
from torc.benchmark.store import TRIAL, Store
from torc.episode.events import Event, Executed, Halted, Looked
from torc.io.reading import read_text
from torc.io.results import write_json
from torc.vlm.cache import CacheConfig
from torc_lab.bench.judging import UNJUDGED, ask_verdict, judged, unjudged
from torc_lab.lab_file import Lab
from torc_lab.person import Confirming, Person
from torc_lab.retrieval import Operation, retrieve
from torc_lab.scenes.laying_out import THRESHOLD, Layout, Screen, lay_out
from torc_lab.scenes.scene import Scene


@dataclass(frozen=True)
class LabBench:
    """Who and what takes part.

    Attributes:
        store: of the caller, who has locked it; `spec` is what it holds.
        scenes: by the name that stands for the problem's.
        confirm: before which motions the person is asked.
        screen: where the live picture is shown, if anywhere.
        say: told a line of text. It does not tell which planner plays: who judges should not know.
    """

    lab: Lab
    store: Store
    spec: BenchSpec
    scenes: Mapping[str, Scene]
    person: Person
    confirm: Confirming = "motion"
    threshold: float = THRESHOLD
    screen: Screen | None = None
    vlm_cache: CacheConfig | None = None
    say: Callable[[str], None] = print

    def play(self, limit: int | None = None) -> int:
        """Plays what is missing, at most `limit` trials; how many were completed. A trial that was interrupted, or in
        which a device was lost, is not scored, and is played again.

        Before a trial begins nothing moves, and the person is asked whether it may, whatever `confirm` is. Ends early
        if the person says so. Raises KeyboardInterrupt, and LabError if nobody answers what came of a trial: what was
        completed stays, and the next call asks again.
        """
        self._ask_for_verdicts()
        done = 0
        while (left := self.store.left(self.spec)) and (limit is None or done < limit):
            trial = left[0]
            place = f"{self.spec.trials.index(trial) + 1} of {len(self.spec.trials)}"
            self.say(f"\nTrial {place}: scene {self._scene(trial).name}.")
            try:
                status = self._play_one(trial)
            except TorcError as error:
                if self._is_unjudged(trial):
                    raise
                status = "errored"
                self.say(f"It did not begin: {error}")
            if status is None:
                break
            done += status == "completed"
            if status != "completed" and not self.person.ask("It does not count. Play it again?"):
                break
        return done

    def _play_one(self, trial: PlannedTrial) -> str | None:
        """How it ended; None if the person stops before it began."""
        scene, person = self._scene(trial), self.person
        layout = lay_out(self.lab, scene, person, self.threshold, self.screen, self.say)
        if layout is None or not person.ask("Step back, the e-stop in your hand. The robot begins. Go?"):
            return None
        work = self.store.work(trial)
        shutil.rmtree(work, ignore_errors=True)
        began = datetime.now(UTC).isoformat(timespec="seconds")
        played = retrieve(
            self.lab,
            trial.spec(self.store.problem_path(trial.problem)),
            scene.wanted,
            work / TRIAL,
            Operation(self.confirm, person.ask),
            listeners=[self._tell],
            vlm_cache=self.vlm_cache,
            say=self.say,
        )
        if played.directory != work / TRIAL:
            raise KeyboardInterrupt  # it was taken for the end of the trial, but was meant for all
        result = {**played.result.plain, **_around(scene, layout, began)}
        completed = result["status"] == "completed"
        write_json(played.directory / "result.json", unjudged(result) if completed else result)
        self.store.accept(trial, work, None)
        if completed:
            return self._judge(trial)
        self.say(f"{result['status']}: {result.get('error') or '; '.join(result.get('halts', ()))}")
        return str(result["status"])

    def _ask_for_verdicts(self) -> None:
        """Of trials that were played when this was ended before anybody told what came of them."""
        for trial in filter(self._is_unjudged, self.spec.trials):
            result = self.store.result(trial)
            began = result.plain.get("began", "?") if result is not None else "?"
            what = f"scene {self._scene(trial).name}, begun {began}"
            if self.person.ask(f"A trial was played ({what}), but not judged. Do you know what came of it?"):
                self._judge(trial)
            else:
                self.say("Then it is played again.")

    def _is_unjudged(self, trial: PlannedTrial) -> bool:
        result = self.store.result(trial)
        return result is not None and result.status == UNJUDGED

    def _judge(self, trial: PlannedTrial) -> str:
        path = self.store.directory(trial) / "result.json"
        result: dict[str, Any] = json.loads(read_text(path))
        verdict = ask_verdict(self.person, self._scene(trial), max(1, int(result["picks"])), self.say)
        write_json(path, judged(result, verdict))
        return "completed"

    def _scene(self, trial: PlannedTrial) -> Scene:
        return self.scenes[trial.problem.name]

    def _tell(self, event: Event) -> None:
        """Tells what happens, but neither who plays nor why."""
        match event:
            case Looked():
                self.say(f"Pick {event.pick + 1}: {len(event.look.context.scene.objects)} objects in sight.")
            case Executed():
                detail = f": {event.outcome.detail}" if event.outcome.detail else ""
                self.say(f"  {event.outcome.result.value}{detail}")
            case Halted():
                self.say(f"  halted: {event.reason}")


def _around(scene: Scene, layout: Layout, began: str) -> dict[str, Any]:
    return {"scene": scene.name, "began": began, "layout": layout.facts()}


def keep_scenes(store: Store, directories: Mapping[str, Path]) -> None:
    """Copies scenes into the store, as they were when they were laid out. Raises InputError."""
    for name, directory in directories.items():
        place = store.root / "scenes" / name
        if place.exists():
            continue
        aside = place.with_name(name + ".partial")
        try:
            with suppress(FileNotFoundError):
                shutil.rmtree(aside)
            shutil.copytree(directory, aside)
            aside.rename(place)
        except OSError as error:
            raise InputError(f"Cannot copy the scene '{directory}' to '{place}': {error}.") from None
