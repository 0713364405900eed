"""A whole trial without physics: analytic shapes, a robot that obeys, real perception and grasps, a real directory."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.helpers.fake_episode import FakeRobot, fake_system
from torc.episode.events import Listener, Started
from torc.episode.loop import Episode, run_episode
from torc.episode.steps import EpisodeConfig
from torc.perception.protocol import Wanted
from torc.records import PickOutcome
from torc.robots.loading import load_robot
from torc.specs.spec_files import to_plain
from torc.specs.trial import TrialSpec
from torc.task_planning.protocol import TaskPlanner
from torc.testing.synthetic import Shape, SyntheticBox
from torc.trials.log import RESULT_FORMAT, TrialResult, result_facts
from torc.trials.recorder import TrialRecorder
from torc.trials.trial import Trial

SHAPES: tuple[Shape, ...] = (
    SyntheticBox(0, (0.66, -0.12, 1.08), (0.05, 0.05, 0.06)),
    SyntheticBox(1, (0.58, -0.12, 1.15), (0.05, 0.14, 0.20)),
    SyntheticBox(2, (0.62, -0.30, 1.10), (0.05, 0.05, 0.10)),
)
"""The target 0 hidden behind the tall box 1, and a box 2 beside them."""


def play_fake_trial(
    spec: TrialSpec,
    out: Path,
    planner: TaskPlanner,
    listeners: Sequence[Listener] = (),
    shapes: Sequence[Shape] = SHAPES,
    results: Sequence[PickOutcome] = (),
    names: Mapping[int, int] | None = None,
) -> Trial:
    """Play a trial as `run_trial` does, with fakes for robot and motions.

    The problem of `spec` is not looked at: `shapes` stand on the table. Picks beyond `results` succeed.
    `names` are perception's own ids by the shapes', where it has such.
    """
    robot = FakeRobot(load_robot(), shapes, results)
    recorder = TrialRecorder(out, to_plain(spec, {}), overwrite=True)
    called = tuple(f"thing {s.id}" for s in shapes)
    started = Started(
        spec.problem, planner.name, spec.seed, "the small box", spec.conditions.max_picks, called
    )
    try:
        config = EpisodeConfig(started.max_picks, started.seed)
        wanted = Wanted(started.target_description)
        episode = Episode(robot, fake_system(robot, names), wanted, config, [recorder, *listeners])
        ended = run_episode(episode, planner, started)
    except KeyboardInterrupt:
        result = TrialResult(status="interrupted")
        recorder.write_result(result)
        return Trial(result, tuple(recorder.lines), recorder.partial)
    result = TrialResult(format=RESULT_FORMAT, status="completed", **result_facts(ended))
    recorder.complete(result)
    return Trial(result, tuple(recorder.lines), out)
