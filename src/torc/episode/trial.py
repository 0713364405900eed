"""One trial in simulation: a problem, a task planner and a seed, to a directory of results."""

import importlib.metadata
import platform
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torc
from torc.episode.event_log import result_facts
from torc.episode.events import Ended, Event, Listener, Started
from torc.episode.loop import EpisodeConfig, EpisodeParts, rehearse, run_episode
from torc.episode.recorder import TrialRecorder
from torc.episode.video import VideoRecorder
from torc.errors import TorcError
from torc.grasping.planner import GeometricGraspPlanner
from torc.motion.planner import OmplMotionPlanner
from torc.perception.noise import stereo_camera
from torc.perception.privileged import LabelPerception
from torc.pipeline.look import Pipeline
from torc.pipeline.warm_up import compiling_once
from torc.robots.description import RobotDescription, load_robot
from torc.scenes.problem import Problem, load_problem
from torc.scenes.workspace import Workspace
from torc.sim.robot import SimulatedRobot
from torc.sim.world import build_world
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import make_planner

RESULT_FORMAT = "torc-trial/1"
_VERSIONED = ("numpy", "scipy", "numba", "mujoco-core", "ompl", "pin-pink", "daqp", "toppra", "cmeel-toppra")


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
    """

    problem: str
    planner: str
    seed: int = 0
    max_picks: int = 15
    noise: bool = False
    robot: str = "sda10f_2f85"

    @property
    def default_name(self) -> str:
        """A directory name for the trial."""
        return f"{Path(self.problem).stem}-{self.planner.replace(':', '.')}-{self.seed}"


@dataclass(frozen=True)
class Trial:
    """A trial that has ended: its directory and the content of result.json."""

    directory: Path
    result: dict[str, Any]


def run_trial(
    spec: TrialSpec,
    out: Path,
    *,
    listeners: Sequence[Listener] = (),
    video: bool = False,
    overwrite: bool = False,
    save_records: bool = False,
    say: Callable[[str], None] = print,
) -> Trial:
    """Play one trial and write its directory.

    A broken simulation or a crash of a part makes the trial "errored", never a failed retrieval; Ctrl-C makes it
    "interrupted" and leaves `<out>.partial` readable.

    Raises:
        InputError: the problem, planner or output directory cannot be used; nothing was run.
    """
    problem, planner = load_problem(spec.problem), make_planner(spec.planner)
    recorder = TrialRecorder(out, asdict(spec), overwrite=overwrite, records=save_records)
    facts: dict[str, Any] = {"status": "errored"}
    try:
        video_path = recorder.partial / "video.mp4" if video else None
        facts = _play(spec, problem, planner, [recorder, *listeners], video_path, say)
    except KeyboardInterrupt:
        result = _result({"status": "interrupted"})
        recorder.write_result(result)
        return Trial(recorder.partial, result)
    except Exception as error:
        # Whatever broke, the trial is recorded as errored with the cause, and what was computed before is kept.
        facts["error"] = str(error) if isinstance(error, TorcError) else f"{type(error).__name__}: {error}"
        (recorder.partial / "error.txt").write_text(traceback.format_exc(), encoding="utf-8")
    result = _result(facts)
    recorder.complete(result)
    return Trial(out, result)


def default_pipeline(robot: RobotDescription, workspace: Workspace, *, noise: bool = False) -> Pipeline:
    """The shipped parts between camera and task planner."""
    return Pipeline(
        perception=LabelPerception(),
        grasp_planner=GeometricGraspPlanner(robot.gripper, workspace.support_z_m),
        robot=robot,
        workspace=workspace,
        noise=stereo_camera() if noise else None,
    )


def _play(
    spec: TrialSpec,
    problem: Problem,
    planner: TaskPlanner,
    listeners: list[Listener],
    video: Path | None,
    say: Callable[[str], None],
) -> dict[str, Any]:
    workspace, robot = Workspace(), load_robot(spec.robot)
    names = tuple(placement.name for placement in problem.ordered())
    started = Started(problem.name, planner.name, spec.seed, problem.description, spec.max_picks, names)
    last = _Last()
    with ExitStack() as stack:
        film = stack.enter_context(VideoRecorder(video)) if video is not None else None
        world = build_world(problem, robot, workspace)
        simulated = stack.enter_context(SimulatedRobot(world, observer=film.observe if film else None))
        if film is not None:
            film.observe(world)
            listeners = [*listeners, film]
        parts = EpisodeParts(
            simulated,
            default_pipeline(robot, workspace, noise=spec.noise),
            planner,
            OmplMotionPlanner(robot, workspace),
        )
        with compiling_once(say, "run") as cold:
            if cold:
                rehearse(parts)
        run_episode(parts, started, EpisodeConfig(spec.max_picks, spec.seed), [*listeners, last])
    return {"status": "completed", **last.facts}


class _Last:
    """Keeps the result that the episode ended with."""

    def __init__(self) -> None:
        self.facts: dict[str, Any] = {}

    def __call__(self, event: Event) -> None:
        if isinstance(event, Ended):
            self.facts = result_facts(event.result)


def _result(facts: dict[str, Any]) -> dict[str, Any]:
    return {"format": RESULT_FORMAT, **facts, "versions": versions()}


def versions() -> dict[str, str]:
    """Versions of what decides results: torc, Python, and the libraries that compute."""
    found = {"torc": torc.__version__, "python": platform.python_version(), "platform": sys.platform}
    for name in _VERSIONED:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
