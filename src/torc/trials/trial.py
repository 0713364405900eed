"""Play one trial in simulation: a problem, a task planner and a seed, to a directory of results."""

import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from torc.episode.bound import Bound
from torc.episode.events import Event, Listener, Looked, Started
from torc.episode.loop import run_episode
from torc.episode.privileged import Privileged, Simulation, Truth, open_sandbox
from torc.episode.simulated import episode_in, needs_color, simulated_robot
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError, TorcError
from torc.pipeline.building import System, build_system, sources
from torc.pipeline.look import Look
from torc.pipeline.planners import make_spec_planner, spec_of_object
from torc.pipeline.warm_up import announced_compilation
from torc.problems.problem import load_problem, robot_hint
from torc.records import PlanningContext
from torc.registry.kinds import PERCEPTIONS, TASK_PLANNERS
from torc.registry.loading import is_shipped
from torc.sim.robot import SimulatedRobot
from torc.sim.simulated_world import World
from torc.sim.stepping import Observer
from torc.specs.spec_files import to_plain
from torc.specs.trial import TrialSpec
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.relations import find_adjacencies
from torc.trials.log import RESULT_FORMAT, EventLine, TrialResult, result_facts
from torc.trials.pick_view import view_of
from torc.trials.recorded import VIDEO
from torc.trials.recorder import TrialLog, TrialRecorder
from torc.trials.trajectory import TrajectoryRecorder
from torc.trials.versions import versions
from torc.trials.video import VideoRecorder
from torc.vlm.cache import CacheConfig
from torc.vlm.simulated.profiles import find_profile
from torc.vlm.simulated.situation import Situation


@dataclass(frozen=True)
class Trial:
    """A trial that has ended.

    Attributes:
        result: the outcome.
        log: everything that happened, in order.
        directory: where it was written; None if it was only kept in memory.
    """

    result: TrialResult
    log: tuple[EventLine, ...]
    directory: Path | None = None


@dataclass(frozen=True, kw_only=True)
class Recording:
    """What to keep of a trial beside events and pictures.

    Attributes:
        pictures: write what the planner saw at each pick: pictures, and the view that `torc view` shows.
        video: write video.mp4.
        trajectory: write trajectory.npz with camera.mp4, for learning.
        snapshots: save each one as a record.
        observers: called with the world 25 times a simulated second.
    """

    pictures: bool = True
    video: bool = False
    trajectory: bool = False
    snapshots: bool = False
    observers: tuple[Observer, ...] = ()


def run_trial(
    spec: TrialSpec,
    out: Path | None,
    *,
    planner: TaskPlanner | None = None,
    listeners: Sequence[Listener] = (),
    recording: Recording | None = None,
    overwrite: bool = False,
    vlm_cache: CacheConfig | None = None,
    say: Callable[[str], None] = print,
) -> Trial:
    """Play one trial in the simulator, and write its directory unless `out` is None.

    A broken simulation, a model's server without a reply, or a crash of a part makes the trial "errored", never a
    failed retrieval. Ctrl-C makes it "interrupted" and leaves `<out>.partial` readable.

    Args:
        spec: the problem, planner, seed and conditions.
        out: the directory; None keeps the log in memory.
        planner: a ready-made planner, e.g. a person at a browser, instead of one made from spec.planner. The trial is
            recorded under its `name`, unless spec.planner names its class.
        listeners: called with every event, in order.
        recording: what to write beside events and pictures.
        overwrite: replace a trial that is in `out`.
        vlm_cache: where replies of the planner's model are kept.
        say: called with a line of text before something that takes long.

    Returns:
        The trial: its result and log.

    Raises:
        InputError: the problem, planner, robot, model or directory cannot be used; nothing was run.
    """
    recording = recording or Recording()
    problem = load_problem(spec.problem)
    who = spec.planner if planner is None else spec_of_object(spec.planner, planner)
    spec = replace(spec, planner=who, conditions=spec.conditions.at(problem.workspace))
    asked, system = spec.planner.vlm, build_system(spec.conditions)
    situations = Situations() if asked is not None and asked.simulated else None
    truth = None if situations is None else situations.situation
    planner = planner or make_spec_planner(spec.planner, vlm_cache, truth)
    privileged = [part for part in (planner, situations) if isinstance(part, Privileged)]
    if privileged and not PERCEPTIONS.traits(system.pipeline.perception).needs_labels:
        raise InputError(
            f"'{spec.planner.asking}' knows the objects by the simulator's own ids, and --perception "
            f"{spec.conditions.perception} gives them others. Play it with --perception labels."
        )
    knows_more = bool(privileged) or TASK_PLANNERS.traits(planner).privileged
    about: dict[str, Any] = {
        "vlm": None if asked is None else asked.text,
        # A planner that knows the simulator's truth, or sees more than planners do, plays but does not compete.
        "participant": not (knows_more or spec.planner.outside_view),
    }
    if asked is not None and asked.simulated:
        about["simulated_vlm"] = asdict(find_profile(asked.model))
    recorded = to_plain(spec, sources(spec.conditions))
    if out is None and (recording.video or recording.trajectory or recording.snapshots):
        raise InputError("A video, a trajectory or snapshots need a directory: give `out`.")
    recorder = (
        TrialLog()
        if out is None
        else TrialRecorder(
            out,
            recorded,
            overwrite=overwrite,
            pictures=recording.pictures,
            snapshots=recording.snapshots,
        )
    )
    recorder.asked = asked
    kept = out is not None and (recording.pictures or recording.video or recording.snapshots)
    # A subclass may read what its parent does not: only a planner's own class can say that it reads no picture.
    reads_picture = vars(type(planner)).get("reads_picture", True)
    color = bool(kept or listeners or reads_picture or needs_color(system))

    def play() -> dict[str, Any]:
        with ExitStack() as stack:
            observers = list(recording.observers)

            def observe(world: World) -> None:
                for each in observers:
                    each(world)

            simulated = stack.enter_context(simulated_robot(system, problem, color=color, observer=observe))
            films: list[VideoRecorder | TrajectoryRecorder] = []
            if recorder.directory is not None and recording.video:
                film = VideoRecorder(recorder.directory / VIDEO, simulated.world)
                films.append(stack.enter_context(film))
            if recorder.directory is not None and recording.trajectory:
                motion = TrajectoryRecorder(recorder.directory, simulated.world)
                films.append(stack.enter_context(motion))
            observers += [film.observe for film in films]
            told = [recorder, *listeners, *([] if situations is None else [situations]), *films]
            if hint := robot_hint(problem, system.robot.name, system.robot.source):
                say(hint)
            absent = simulated.take_over()
            observe(simulated.world)
            return _play(spec, system, simulated, absent, planner, privileged, told, say)

    return recorded_trial(recorder, about, play)


def recorded_trial(
    recorder: TrialLog,
    about: dict[str, Any],
    play: Callable[[], dict[str, Any]],
    refused: type[TorcError] = InputError,
) -> Trial:
    """Play a trial, and write its outcome.

    Any failure makes the trial "errored" with its cause, and keeps what was computed before; Ctrl-C makes it
    "interrupted".

    Args:
        recorder: keeps the log.
        about: facts for the result.
        play: plays, and returns further facts.
        refused: an error of this class, before anything was recorded, leaves nothing, and is raised.
    """
    try:
        facts = play()
    except KeyboardInterrupt:
        result = _result({"status": "interrupted"} | about | recorder.vlm_facts)
        recorder.write_result(result)
        return Trial(result, tuple(recorder.lines), recorder.directory)
    except Exception as error:
        if isinstance(error, refused) and not recorder.lines:
            recorder.discard()
            raise
        told = str(error) if isinstance(error, TorcError) else f"{type(error).__name__}: {error}"
        facts = {"status": "errored", "error": told}
        recorder.note_error(traceback.format_exc())
    result = _result(facts | about | recorder.vlm_facts)
    recorder.complete(result)
    return Trial(result, tuple(recorder.lines), recorder.directory)


def _play(
    spec: TrialSpec,
    system: System,
    simulated: SimulatedRobot,
    absent: tuple[int, ...],
    planner: TaskPlanner,
    privileged: Sequence[Privileged],
    listeners: Sequence[Listener],
    say: Callable[[str], None],
) -> dict[str, Any]:
    problem, max_picks = simulated.world.problem, spec.conditions.max_picks
    names = tuple(placement.name for placement in problem.ordered())
    vlm = "" if spec.planner.vlm is None else spec.planner.vlm.text
    target = problem.description
    started = Started(problem.name, planner.name, spec.seed, target, max_picks, names, absent, vlm)
    config = EpisodeConfig(max_picks, spec.seed)
    with announced_compilation(say):
        _rehearse_once(spec, system, simulated, planner)
    with ExitStack() as stack:
        if privileged:
            sandbox = stack.enter_context(open_sandbox(problem, system, config))
            simulation = Simulation(simulated, sandbox, config, say)
            for part in privileged:
                part.attach(simulation)
            listeners = [*listeners, simulation]
        episode = episode_in(simulated, system, config, listeners)
        result = run_episode(episode, planner, started)
    # A planner may know how sure it is that its costs are the least.
    bound = TASK_PLANNERS.traits(planner).bound
    facts = {"status": "completed", **result_facts(result)}
    if problem.absent:
        facts["target_absent"] = True
    return facts | {"bound": bound.value} if isinstance(bound, Bound) else facts


_rehearsed: set[str] = set()
"""Planners and conditions, as text, that this process has rehearsed."""


def _rehearse_once(spec: TrialSpec, system: System, simulated: SimulatedRobot, planner: TaskPlanner) -> None:
    """Rehearse, unless this process did it with these parts before: their kernels are loaded.

    User-defined parts, and robots and workspaces from files, may load something for each trial: they always rehearse.
    """
    parts = repr((spec.planner, spec.conditions))
    if parts in _rehearsed:
        return
    rehearsal = episode_in(simulated, system, EpisodeConfig()).rehearse(planner)
    view_of(rehearsal.context)  # what the recorder does with every look
    if is_shipped(TASK_PLANNERS, spec.planner.name) and not sources(spec.conditions):
        _rehearsed.add(parts)


def _result(facts: dict[str, Any]) -> TrialResult:
    return TrialResult.model_validate({"format": RESULT_FORMAT} | facts | {"versions": versions()})


_MIN_HIDDEN_PX = 10
_MIN_HIDDEN_SHARE = 0.03


class Situations:
    """The situation at the latest look of a trial. It is one of the trial's listeners."""

    def __init__(self) -> None:
        self._simulation: Simulation | None = None
        self._look: Look | None = None
        self._situation: Situation | None = None

    def attach(self, simulation: Simulation) -> None:
        """Take the simulation of a trial."""
        self._simulation, self._look, self._situation = simulation, None, None

    def __call__(self, event: Event) -> None:
        """Remember the latest look."""
        if isinstance(event, Looked):
            self._look, self._situation = event.look, None

    def situation(self) -> Situation:
        """Return the true situation now, between two picks. Raises InputError if no trial has begun."""
        if self._situation is None:
            if self._simulation is None or self._look is None:
                raise InputError("The simulated VLM was asked outside of a simulated trial; use torc run.")
            self._situation = situation_of(self._look.context, self._simulation.truth())
        return self._situation


def situation_of(context: PlanningContext, truth: Truth) -> Situation:
    """Return the true situation, in the terms of a marked image.

    Who lies on whom and who hides whom is the simulator's truth. Which objects carry a number, which are graspable and
    what blocks their grasps is what the pipeline found, since choices are judged by that.
    """
    scene, report, counted, ids = context.scene, context.report, truth.visibility, context.report.object_ids
    enough = np.maximum(_MIN_HIDDEN_PX, _MIN_HIDDEN_SHARE * counted.pixels_alone)
    hides = np.argwhere(counted.hidden_by >= enough[:, None]).tolist()
    return Situation(
        in_sight={o.id: o.pixel_count for o in scene.objects},
        graspable=frozenset(k for k in report.graspable_ids if k in scene.ids),
        lies_on=truth.lies_on,
        hides={(front, back): int(counted.hidden_by[back, front]) for back, front in hides},
        blocks=frozenset((ids[j], ids[i]) for i, j in np.argwhere(report.blocking > 0).tolist() if i != j),
        near=frozenset((pair.first, pair.second) for pair in find_adjacencies(scene)),
    )
