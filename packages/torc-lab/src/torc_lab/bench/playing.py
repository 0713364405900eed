"""A comparison on a real robot: its trials and their order, and playing them with a person who lays out, confirms and
judges.
"""

import json
import shutil
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import torc
from torc import InputError, TorcError
from torc.benchmark.rows import REAL
from torc.benchmark.spec import BenchPlanner, BenchProblem, BenchSpec, PlannedTrial, find_around, make_spec
from torc.benchmark.store import TRIAL, Store
from torc.episode.events import Event, Executed, Halted, Looked
from torc.io.reading import read_text
from torc.io.results import write_json
from torc.pipeline.planners import refuse_simulated
from torc.vlm.cache import CacheConfig
from torc_lab.bench.judging import UNJUDGED, ask_verdict, judged, unjudged
from torc_lab.lab_file import Lab
from torc_lab.person import Confirming, Person
from torc_lab.retrieval import Operation, retrieve
from torc_lab.scenes.laying_out import THRESHOLD, lay_out
from torc_lab.scenes.scene import Scene

if TYPE_CHECKING:
    from torc.web.frames import FrameBoard


def plan_lab_bench(
    lab: Lab, scenes: Sequence[Scene], planners: Sequence[BenchPlanner], repeats: int, order_seed: int = 0
) -> BenchSpec:
    """Every planner in every scene, several times, scene by scene. In a scene every round has each planner once, in an
    order that `order_seed`, the scene and the round decide: neither the light nor who lays out gets used to one.

    The repeat is the seed of the trial. Raises InputError: two scenes of one name, planners that know the simulation,
    or nothing to play.
    """
    names = [scene.name for scene in scenes]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(
            f"More than one scene is called {', '.join(twice)}: rename a directory and store it again."
        )
    if repeats < 1:
        raise InputError("--repeats must be at least 1.")
    for planner in planners:
        refuse_simulated(planner.spec.name)
        if planner.spec.vlm is not None and planner.spec.vlm.simulated:
            raise InputError("A simulated model answers by the simulator's truth, which no real scene has.")
    problems = [BenchProblem(scene.problem, REAL, scene.digest, shipped=False) for scene in scenes]
    spec = make_spec(problems, planners, range(repeats), find_around(lab.conditions), torc.__version__)
    by_cell = {trial.cell: trial for trial in spec.trials}
    ordered = []
    for problem in problems:
        for round_ in range(repeats):
            rng = np.random.default_rng([order_seed, zlib.crc32(problem.name.encode()), round_])
            labels = [planners[k].label for k in rng.permutation(len(planners))]
            ordered += [by_cell[label, problem.name, round_] for label in labels]
    return BenchSpec(spec.around, tuple(ordered))


@dataclass(frozen=True)
class LabBench:
    """Who and what takes part.

    Attributes:
        store: of the caller, who has locked it; `spec` is what it holds.
        scenes: by the name that stands for the problem's.
        confirm: before which motions the person is asked.
        board: where the live picture is shown, if anywhere.
        person: is not told which planner plays: who judges should not know.
    """

    lab: Lab
    store: Store
    spec: BenchSpec
    scenes: Mapping[str, Scene]
    person: Person
    confirm: Confirming = "motion"
    threshold: float = THRESHOLD
    board: "FrameBoard | None" = None
    vlm_cache: CacheConfig | None = None

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
            self.person.say(f"\nTrial {place}: scene {self._scene(trial).name}.")
            try:
                status = self._play_one(trial)
            except TorcError as error:
                if self._is_unjudged(trial):
                    raise
                status = "errored"
                self.person.say(f"It did not begin: {error}")
            if status is None:
                break
            done += status == "completed"
            if status != "completed" and not self.person.ask("It does not count. Play it again?"):
                break
        return done

    def _play_one(self, trial: PlannedTrial) -> str | None:
        """How it ended; None if the person stops before it began."""
        scene, person = self._scene(trial), self.person
        layout = lay_out(self.lab, scene, person, self.threshold, self.board)
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
            say=self.person.say,
        )
        if played.directory != work / TRIAL:
            raise KeyboardInterrupt  # it was taken for the end of the trial, but was meant for all
        about = {"scene": scene.name, "began": began, "layout": layout.facts()}
        result = {**played.result.plain, **about}
        completed = result["status"] == "completed"
        write_json(played.directory / "result.json", unjudged(result) if completed else result)
        self.store.accept(trial, work, None)
        if completed:
            return self._judge(trial)
        self.person.say(f"{result['status']}: {result.get('error') or '; '.join(result.get('halts', ()))}")
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
                self.person.say("Then it is played again.")

    def _is_unjudged(self, trial: PlannedTrial) -> bool:
        result = self.store.result(trial)
        return result is not None and result.status == UNJUDGED

    def _judge(self, trial: PlannedTrial) -> str:
        path = self.store.directory(trial) / "result.json"
        result: dict[str, Any] = json.loads(read_text(path))
        verdict = ask_verdict(self.person, self._scene(trial), max(1, int(result["picks"])))
        write_json(path, judged(result, verdict))
        return "completed"

    def _scene(self, trial: PlannedTrial) -> Scene:
        return self.scenes[trial.problem.name]

    def _tell(self, event: Event) -> None:
        """Tells what happens, but neither who plays nor why."""
        match event:
            case Looked():
                self.person.say(
                    f"Pick {event.pick + 1}: {len(event.look.context.scene.objects)} objects in sight."
                )
            case Executed():
                detail = f": {event.outcome.detail}" if event.outcome.detail else ""
                self.person.say(f"  {event.outcome.result.value}{detail}")
            case Halted():
                self.person.say(f"  halted: {event.reason}")


def keep_scenes(store: Store, directories: Mapping[str, Path]) -> None:
    """Copies scenes into the store, as they were when they were laid out. Raises InputError."""
    for name, directory in directories.items():
        place = store.root / "scenes" / name
        if place.exists():
            continue
        aside = place.with_name(name + ".partial")
        try:
            shutil.rmtree(aside, ignore_errors=True)
            shutil.copytree(directory, aside)
            aside.rename(place)
        except OSError as error:
            raise InputError(f"Cannot copy the scene '{directory}' to '{place}': {error}.") from None
