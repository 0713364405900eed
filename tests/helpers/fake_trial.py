"""A whole trial without physics: analytic shapes, a robot that obeys, real perception and grasps, a real directory."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.helpers.fake_episode import FakeRobot, fake_parts
from torc.episode.events import Listener, Started
from torc.episode.log_writing import result_facts
from torc.episode.loop import run_episode
from torc.episode.recorder import TrialRecorder
from torc.episode.trial import RESULT_FORMAT, Trial
from torc.records import PickOutcome
from torc.robots.loading import load_robot
from torc.specs.spec_files import to_plain
from torc.specs.trial import TrialSpec
from torc.task_planning.protocol import TaskPlanner
from torc.testing.synthetic import Shape, SyntheticBox

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
    picking = fake_parts(FakeRobot(load_robot(), shapes, results), names)
    recorder = TrialRecorder(out, to_plain(spec, {}), overwrite=True)
    called = tuple(f"thing {s.id}" for s in shapes)
    started = Started(
        spec.problem, planner.name, spec.seed, "the small box", spec.conditions.max_picks, called
    )
    try:
        ended = run_episode(picking, planner, started, [recorder, *listeners])
    except KeyboardInterrupt:
        result = {"format": RESULT_FORMAT, "status": "interrupted"}
        recorder.write_result(result)
        return Trial(recorder.partial, result)
    result = {"format": RESULT_FORMAT, "status": "completed", **result_facts(ended)}
    recorder.complete(result)
    return Trial(out, result)
