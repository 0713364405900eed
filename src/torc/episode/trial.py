"""One trial in simulation: a problem, a task planner and a seed, to a directory of results."""

import re
import traceback
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

from torc.episode.bound import Bounding
from torc.episode.conditions import sources
from torc.episode.event_log import result_facts
from torc.episode.events import Ended, Event, Listener, Started
from torc.episode.loop import rehearse, run_episode
from torc.episode.pick_view import view_of
from torc.episode.planners import load_trial_planner, make_trial_planner
from torc.episode.privileged import Privileged, Simulation, open_sandbox
from torc.episode.recorder import TrialRecorder
from torc.episode.steps import EpisodeConfig, EpisodeParts
from torc.episode.trajectory import TrajectoryRecorder
from torc.episode.versions import versions
from torc.episode.video import VideoRecorder
from torc.episode.witness import Witness
from torc.errors import InputError, TorcError
from torc.grasping.names import DEFAULT_GRASPS
from torc.motion.planner import OmplMotionPlanner
from torc.pipeline.defaults import default_pipeline
from torc.pipeline.min_score import DEFAULT_MIN_SCORE
from torc.pipeline.warm_up import announced_compilation
from torc.plugins import short_part_name
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT
from torc.scenes.made_for import robot_hint
from torc.scenes.problem import Problem, load_problem
from torc.scenes.workspace import Workspace
from torc.sim.robot import SimulatedRobot
from torc.sim.stepping import Observer
from torc.sim.world import World, build_world
from torc.task_planning.protocol import TaskPlanner
from torc.vlm.cache import CacheConfig
from torc.vlm.config import VlmConfig
from torc.vlm.opening import Truth, planner_options
from torc.vlm.simulated.profiles import find_profile

RESULT_FORMAT = "torc-trial/1"


@dataclass(frozen=True)
class TrialSpec:
    """What decides a trial's result.

    Attributes:
        problem: name of a shipped problem or path of a problem file.
        planner: name in the registry or module:Class.
        seed: decides all random draws.
        max_picks: attempts, failed ones included.
        noise: add sensor noise.
        robot: name or path of the robot description.
        vlm: the model that the planner asks, for planners that ask one.
        min_score: less likely grasps wait until there are no better ones; see `Pipeline`.
        expert: who decides, where the planner is a person.
        grasps: name in the registry of grasp planners or module:Class.
        outside_view: the expert sees the scene from outside while playing.
    """

    problem: str
    planner: str
    seed: int = 0
    max_picks: int = 15
    noise: bool = False
    robot: str = DEFAULT_ROBOT
    vlm: VlmConfig | None = None
    min_score: float = DEFAULT_MIN_SCORE
    expert: str = ""
    grasps: str = DEFAULT_GRASPS
    outside_view: bool = False

    @property
    def default_name(self) -> str:
        """A directory name for the trial."""
        model = "-" + re.sub(r"[^\w.]+", "-", self.vlm.short_name) if self.vlm is not None else ""
        expert = f"-{self.expert}" if self.expert else ""
        grasps = "" if self.grasps == DEFAULT_GRASPS else "-" + short_part_name(self.grasps)
        planner = short_part_name(self.planner)
        robot = "" if self.robot == DEFAULT_ROBOT else f"-{Path(self.robot).stem}"
        outside = "-outside" if self.outside_view else ""
        return f"{Path(self.problem).stem}-{planner}{model}{expert}{grasps}{robot}{outside}-{self.seed}"


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
    witness = Witness() if spec.vlm is not None and spec.vlm.simulated else None
    truth = None if witness is None else witness.situation
    planner = planner or _make_planner(spec, vlm_cache, truth)
    privileged = [part for part in (planner, witness) if isinstance(part, Privileged)]
    about: dict[str, Any] = {
        "vlm": None if spec.vlm is None else spec.vlm.text,
        # Who knows the simulator's truth, or sees more than planners do, plays, but does not compete.
        "participant": not privileged and not spec.outside_view,
    }
    if spec.vlm is not None and spec.vlm.simulated:
        about["simulated_vlm"] = asdict(find_profile(spec.vlm.model))
    recorded = asdict(spec) | sources(spec.robot, spec.grasps)
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
        facts = _play(spec, problem, planner, privileged, told, observers, films, say)
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


def _make_planner(spec: TrialSpec, vlm_cache: CacheConfig | None, truth: Truth | None) -> TaskPlanner:
    maker = load_trial_planner(spec.planner)
    options = planner_options(spec.planner, maker, spec.vlm, vlm_cache, truth)
    return make_trial_planner(spec.planner, **options)


def _play(
    spec: TrialSpec,
    problem: Problem,
    planner: TaskPlanner,
    privileged: Sequence[Privileged],
    listeners: list[Listener],
    observers: Sequence[Observer],
    films: Sequence[Callable[[], "Film"]],
    say: Callable[[str], None],
) -> dict[str, Any]:
    workspace, robot = Workspace(), load_robot(spec.robot)
    if hint := robot_hint(problem, robot.name, robot.source):
        say(hint)
    last = _Last()
    with ExitStack() as stack:
        for open_film in films:
            film = stack.enter_context(open_film())
            observers, listeners = [*observers, film.observe], [*listeners, film]
        world = build_world(problem, robot, workspace)
        simulated = stack.enter_context(SimulatedRobot(world, observer=_together(observers)))
        absent = simulated.take_over()
        for observe in observers:
            observe(world)
        parts = EpisodeParts(
            simulated,
            default_pipeline(
                robot, workspace, noise=spec.noise, min_score=spec.min_score, grasps=spec.grasps
            ),
            planner,
            OmplMotionPlanner(robot, workspace),
        )
        with announced_compilation(say):
            view_of(rehearse(parts).context)  # what the recorder makes of every look
        names = tuple(placement.name for placement in problem.ordered())
        started = Started(
            problem.name,
            planner.name,
            spec.seed,
            problem.description,
            spec.max_picks,
            names,
            absent,
            "" if spec.vlm is None else spec.vlm.text,
        )
        config = EpisodeConfig(spec.max_picks, spec.seed)
        if privileged:
            sandbox = stack.enter_context(
                open_sandbox(problem, robot, parts.pipeline, parts.motion_planner, config)
            )
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
