"""Plan and play a comparison on a real robot, with a person who lays scenes out, confirms motions and judges trials."""

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
    """Plan each planner's trials in each scene, scene by scene. Each round in a scene has every planner once.

    The order in a round depends on `order_seed`, the scene and the round, so that no planner profits from the light or
    from who lays out. The repeat is the seed of the trial.

    Args:
        repeats: trials of each planner in each scene.
        order_seed: seed of the planners' order.

    Raises:
        InputError: two scenes share a name, a planner or its model needs the simulation, or `repeats` is below 1.
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
    """A comparison of planners in scenes, and who and what takes part in it.

    Attributes:
        store: the results' store, which the caller has locked.
        spec: the trials of the store.
        scenes: the scenes, by problem name.
        confirm: which motions the person has to confirm.
        board: shows the live picture; None for no page.
        person: lays out, confirms and judges, without knowing which planner plays.
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
        """Play missing trials until `limit` are completed; return how many were.

        A trial that was interrupted, or in which a device was lost, is not scored, and is played again. Nothing moves
        before a trial begins, and the person is asked for permission, whatever `confirm` is. Ends early if the person
        says so. Raises KeyboardInterrupt, and LabError if nobody reports the outcome of a trial:
        completed trials stay, and the next call asks again.
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
        """Play a trial; return its status, or None if the person stopped before it began."""
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
        """Ask for the outcomes of trials from an earlier call that nobody has judged yet."""
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
        """Report an event to the person, without naming the planner or its reasons."""
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
    """Copy scenes that the store does not hold yet into it. Raises InputError if a copy fails."""
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
