"""Rehearses, then plays, in a process of its own whose numba cache is empty; prints what was compiled when, as JSON.

Arguments: an empty directory, then problem,planner,noise of each trial.
"""

import json
import sys
from pathlib import Path

import numpy as np

from tests.helpers.fake_episode import FakeRobot
from tests.helpers.kernels import all_signatures, compiled_since
from torc.brain import FrameDecider, load_frame
from torc.episode.loop import Episode
from torc.episode.steps import EpisodeConfig
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.perception.protocol import Wanted
from torc.pipeline.building import System, build_pipeline
from torc.pipeline.planners import make_planner
from torc.records import Capture
from torc.robots.loading import load_robot
from torc.specs.conditions import Conditions
from torc.specs.trial import TrialSpec
from torc.task_planning.protocol import rehearse_planner
from torc.testing.synthetic import random_clutter, synthetic_capture
from torc.trials.pick_view import view_of
from torc.trials.trial import run_trial
from torc.workspace.workspace_files import load_workspace


def main(directory: Path, trials: list[str]) -> dict[str, object]:
    robot, workspace = load_robot(), load_workspace()
    shapes = random_clutter(np.random.default_rng(0), 9)
    motion = SamplingMotionPlanner(robot, workspace)
    planner, pipeline = make_planner("dg-select"), build_pipeline(Conditions(), robot, workspace)
    system = System(Conditions(), robot, workspace, pipeline, motion)
    episode = Episode(FakeRobot(robot, shapes), system, Wanted("the box"), EpisodeConfig())
    rehearsal = episode.rehearse(planner)
    rehearse_planner(make_planner("belief"), rehearsal.context)
    view_of(rehearsal.context)
    rehearsed = all_signatures()
    announced: list[str] = []
    for spec in trials:
        problem, name, noise = spec.split(",")
        trial = run_trial(
            TrialSpec.of(problem, name, noise=noise == "noise"),
            directory / spec,
            say=announced.append,
        )
        if trial.result.status != "completed":
            raise RuntimeError(trial.result)
    played = compiled_since(rehearsed)
    frame = load_frame(write_frame(directory / "frame.npz", synthetic_capture(shapes, workspace.camera)))
    decider = FrameDecider(frame, planner)
    decider.rehearse()
    before = all_signatures()
    decider.decide()
    decided = compiled_since(before)
    never = sorted(name for name, signatures in all_signatures().items() if not signatures)
    return {"played": played, "decided": decided, "announced": announced, "never": never}


def write_frame(path: Path, capture: Capture) -> Path:
    """The file as somebody else's recorder may write it: 64-bit depth, a label per object from 1, 0 the background."""
    o, labels = capture.observation, np.maximum(capture.label_image, -1) + 1
    depth_m = np.asfortranarray(o.depth_m.astype(np.float64))
    np.savez(
        path, rgb=o.rgb, depth_m=depth_m, K=o.K, T_world_camera=o.T_world_camera, labels=labels, target=1
    )
    return path


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]), sys.argv[2:])))
