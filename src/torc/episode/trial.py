"""One trial in simulation: a problem, a task planner and a seed, to a directory of results."""

import traceback
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

from torc.episode.bound import Bounding
from torc.episode.events import Ended, Event, Listener, Started
from torc.episode.log_writing import result_facts
from torc.episode.loop import rehearse, run_episode
from torc.episode.pick_view import view_of
from torc.episode.planners import make_spec_planner
from torc.episode.privileged import Privileged, Simulation, open_sandbox
from torc.episode.recorder import TrialRecorder
from torc.episode.simulated import pick_parts, simulated_robot
from torc.episode.steps import EpisodeConfig, EpisodeParts
from torc.episode.trajectory import TrajectoryRecorder
from torc.episode.versions import versions
from torc.episode.video import VideoRecorder
from torc.episode.witness import Witness
from torc.errors import InputError, TorcError
from torc.pipeline.building import System, build_system, sources
from torc.pipeline.warm_up import announced_compilation
from torc.problems.made_for import robot_hint
from torc.problems.problem import Problem, load_problem
from torc.sim.stepping import Observer
from torc.sim.world import World
from torc.specs.files import to_plain
from torc.specs.trial import TrialSpec
from torc.task_planning.protocol import TaskPlanner
from torc.vlm.cache import CacheConfig
from torc.vlm.simulated.profiles import find_profile

RESULT_FORMAT = "torc-trial/1"


@dataclass(frozen=True)
class Trial:
    """A trial that has ended: its directory and the content of result.json."""

    directory: Path
    result: dict[str, Any]


class Film(AbstractContextManager["Film"], Protocol):
    """Watches a trial's events and its simulation; used in a `with`."""

    def __call__(self, event: Event) -> None:
        """As a listener."""
        ...

    def observe(self, world: World) -> None:
        """As an observer."""
        ...


def run_trial(
    spec: TrialSpec,
    out: Path,
    *,
    planner: TaskPlanner | None = None,
    listeners: Sequence[Listener] = (),
    observers: Sequence[Observer] = (),
    video: bool = False,
    trajectory: bool = False,
    overwrite: bool = False,
    save_records: bool = False,
    vlm_cache: CacheConfig | None = None,
    say: Callable[[str], None] = print,
) -> Trial:
    """Play one trial and write its directory.

    Args:
        spec: what is played.
        out: the directory.
        planner: who decides, if it is not to be made from spec.planner: a person at a browser, say.
        listeners: called with every event, in order.
        observers: called with the world 25 times a simulated second, e.g. to watch the robot.
        video: also write video.mp4.
        trajectory: also write trajectory.npz and camera.mp4: the robot's motions and its camera's video, for learning.
        overwrite: replace an existing directory.
        save_records: also save each snapshot as a record.
        vlm_cache: where replies of a VLM are kept.
        say: told a line of text where something takes long.

    A broken simulation, a VLM's server that gives no reply, or a crash of a part makes the trial "errored", never a
    failed retrieval; Ctrl-C makes it "interrupted" and leaves `<out>.partial` readable.

    Raises:
        InputError: the problem, planner, robot, VLM or output directory cannot be used; nothing was run.
    """
    problem = load_problem(spec.problem)
    asked, system = spec.planner.vlm, build_system(spec.conditions)
    witness = Witness() if asked is not None and asked.simulated else None
    truth = None if witness is None else witness.situation
    planner = planner or make_spec_planner(spec.planner, vlm_cache, truth)
    privileged = [part for part in (planner, witness) if isinstance(part, Privileged)]
    about: dict[str, Any] = {
        "vlm": None if asked is None else asked.text,
        # Who knows the simulator's truth, or sees more than planners do, plays, but does not compete.
        "participant": not privileged and not spec.planner.outside_view,
    }
    if asked is not None and asked.simulated:
        about["simulated_vlm"] = asdict(find_profile(asked.model))
    recorded = to_plain(spec, sources(spec.conditions))
    recorder = TrialRecorder(out, recorded, overwrite=overwrite, records=save_records)
    facts: dict[str, Any] = {"status": "errored"}
    try:
        films: list[Callable[[], Film]] = []
        if video:
            films.append(lambda: VideoRecorder(recorder.partial / "video.mp4"))
        if trajectory:
            films.append(lambda: TrajectoryRecorder(recorder.partial))
        told: list[Listener] = [recorder, *listeners]
        if witness is not None:
            told.append(witness)
        facts = _play(spec, problem, system, planner, privileged, told, observers, films, say)
    except KeyboardInterrupt:
        result = _result({"status": "interrupted", **about})
        recorder.write_result(result)
        return Trial(recorder.partial, result)
    except Exception as error:
        if isinstance(error, InputError) and not recorder.begun:
            recorder.discard()
            raise
        # Whatever broke, the trial is recorded as errored with the cause, and what was computed before is kept.
        facts["error"] = str(error) if isinstance(error, TorcError) else f"{type(error).__name__}: {error}"
        (recorder.partial / "error.txt").write_text(traceback.format_exc(), encoding="utf-8")
    result = _result({**facts, **about})
    recorder.complete(result)
    return Trial(out, result)


def _play(
    spec: TrialSpec,
    problem: Problem,
    system: System,
    planner: TaskPlanner,
    privileged: Sequence[Privileged],
    listeners: list[Listener],
    observers: Sequence[Observer],
    films: Sequence[Callable[[], "Film"]],
    say: Callable[[str], None],
) -> dict[str, Any]:
    if hint := robot_hint(problem, system.robot.name, system.robot.source):
        say(hint)
    last = _Last()
    with ExitStack() as stack:
        for open_film in films:
            film = stack.enter_context(open_film())
            observers, listeners = [*observers, film.observe], [*listeners, film]
        simulated = stack.enter_context(simulated_robot(system, problem, observer=_together(observers)))
        absent = simulated.take_over()
        for observe in observers:
            observe(simulated.world)
        parts = EpisodeParts(pick_parts(system, simulated), planner)
        with announced_compilation(say):
            view_of(rehearse(parts).context)  # what the recorder makes of every look
        names = tuple(placement.name for placement in problem.ordered())
        started = Started(
            problem.name,
            planner.name,
            spec.seed,
            problem.description,
            spec.conditions.max_picks,
            names,
            absent,
            "" if spec.planner.vlm is None else spec.planner.vlm.text,
        )
        config = EpisodeConfig(spec.conditions.max_picks, spec.seed)
        if privileged:
            sandbox = stack.enter_context(open_sandbox(problem, system, config))
            simulation = Simulation(simulated, sandbox, config, say)
            for part in privileged:
                part.attach(simulation)
            listeners = [*listeners, simulation]
        run_episode(parts, started, config, [*listeners, last])
    bound = {"bound": planner.bound.value} if isinstance(planner, Bounding) else {}
    return {"status": "completed", **last.facts, **bound}


def _together(observers: Sequence[Observer]) -> Observer | None:
    """One observer that calls all of them."""

    def observe(world: World) -> None:
        for each in observers:
            each(world)

    return observe if observers else None


class _Last:
    """Keeps the result that the episode ended with."""

    def __init__(self) -> None:
        self.facts: dict[str, Any] = {}

    def __call__(self, event: Event) -> None:
        if isinstance(event, Ended):
            self.facts = result_facts(event.result)


def _result(facts: dict[str, Any]) -> dict[str, Any]:
    return {"format": RESULT_FORMAT, **facts, "versions": versions()}
