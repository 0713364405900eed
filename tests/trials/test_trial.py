"""Whole trials in simulation: the same again, interrupted, errored."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.trial_logs import comparable_log as _log
from tools.grippers import write_slides
from torc.episode.events import Decided, Looked
from torc.episode.loop import Episode
from torc.episode.simulated import simulated_robot
from torc.errors import InputError, PhysicsError
from torc.objects.library import load_object
from torc.pipeline.building import build_system
from torc.problems.problem import ObjectPlacement, Problem, load_problem, save_problem
from torc.sim.rendering import CameraRenderer
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.task_planning.random_choice import RandomPlanner
from torc.trials.log import without_seconds
from torc.trials.trial import Recording, run_trial
from torc.workspace.workspace_files import load_workspace

SPEC = TrialSpec.of("structured-04", "dg-select", seed=3, max_picks=1)


class Reader(RandomPlanner):
    """A planner that may read the picture, though the one that it extends does not."""

    name = "reader"


def _silent(text: str) -> None:
    pass


@pytest.mark.long
def test_same_trial_same_log_also_in_another_process_and_with_a_video(tmp_path):
    import av

    trial = run_trial(SPEC, tmp_path / "a", recording=Recording(video=True), say=_silent)
    assert trial.result.status == "completed"
    options = ["--seed=3", "--max-picks=1", f"--out={tmp_path / 'b'}", "--json"]
    command = [sys.executable, "-m", "torc.cli.main", "run", SPEC.problem, *options]
    subprocess.run(command, check=True, capture_output=True)
    log = _log(tmp_path / "a")
    assert log == _log(tmp_path / "b")
    assert {line["event"] for line in log} == {"started", "looked", "decided", "planned", "executed", "ended"}
    with av.open(str(trial.directory / "video.mp4")) as container:
        assert sum(1 for _ in container.decode(video=0)) > 50


@pytest.mark.parametrize(
    ("planner", "pictures", "drawn"),
    [(RandomPlanner, False, False), (RandomPlanner, True, True), (Reader, False, True)],
)
def test_colour_is_drawn_only_for_what_reads_it(planner, pictures, drawn, monkeypatch, tmp_path):
    asked = []
    render = CameraRenderer.render

    def draw(renderer, *, color):
        asked.append(color)
        return render(renderer, color=color)

    monkeypatch.setattr(CameraRenderer, "render", draw)
    recording = Recording(pictures=pictures)
    run_trial(SPEC, tmp_path / "a", planner=planner(), recording=recording, say=_silent)
    assert set(asked) == {drawn}
    files = {path.name for path in (tmp_path / "a").rglob("*") if path.is_file()}
    assert (files - {"events.jsonl", "result.json", "spec.json"} != set()) == pictures
    log = run_trial(SPEC, None, planner=planner(), listeners=[lambda event: None], say=_silent).log
    assert set(asked) == {drawn, True}  # a listener may read it
    assert _log(tmp_path / "a") == json.loads(json.dumps([without_seconds(line.plain) for line in log]))


def test_only_the_first_trial_of_shipped_parts_rehearses(monkeypatch):
    rehearsed = []
    rehearse = Episode.rehearse
    monkeypatch.setattr("torc.trials.trial._rehearsed", set())
    monkeypatch.setattr(Episode, "rehearse", lambda *args: rehearsed.append(args) or rehearse(*args))

    def stop(event):
        raise KeyboardInterrupt

    def play(planner):
        run_trial(replace(SPEC, planner=PlannerSpec(planner)), None, listeners=[stop], say=_silent)
        return len(rehearsed)

    own = "torc.task_planning.random_choice:RandomPlanner"
    played = ("random", "random", "dg-select", "random", own, own)
    assert [play(name) for name in played] == [1, 1, 2, 2, 3, 4]


def test_friction_is_that_of_everything():
    as_it_is, slippery = (
        simulated_robot(build_system(Conditions(friction=f)), load_problem("structured-04"))
        for f in (1.0, 0.5)
    )
    with as_it_is, slippery:
        half = 0.5 * as_it_is.world.model.geom_friction[:, 0]
        np.testing.assert_allclose(slippery.world.model.geom_friction[:, 0], half)


def test_another_seed_or_sensor_noise_makes_another_log(tmp_path):
    def stop(event):
        if isinstance(event, Looked):
            raise KeyboardInterrupt

    for name, seed, noise in (("a", 0, False), ("b", 1, False), ("c", 0, True)):
        spec = TrialSpec.of("structured-04", "random", seed, noise=noise)
        run_trial(spec, tmp_path / name, listeners=[stop], say=_silent)
    digests = {_log(tmp_path / f"{name}.partial")[1]["digest"] for name in "abc"}
    assert len(digests) == 3


@pytest.mark.long
def test_depth_can_come_from_the_two_pictures_of_a_stereo_camera(tmp_path):
    conditions = Conditions(depth="sgbm", settings={"depth.block_px": 7, "simulation.rig.baseline_m": 0.05})
    spec = replace(SPEC, conditions=replace(conditions, max_picks=1))
    for name in "ab":
        assert run_trial(spec, tmp_path / name, say=_silent).result.status == "completed"
    assert _log(tmp_path / "a") == _log(tmp_path / "b")


def test_ctrl_c_leaves_a_readable_partial_log(tmp_path):
    def interrupt(event):
        if isinstance(event, Decided):
            raise KeyboardInterrupt

    trial = run_trial(SPEC, tmp_path / "trial", listeners=[interrupt], say=_silent)
    assert trial.result.status == "interrupted"
    assert trial.directory == tmp_path / "trial.partial"
    assert not (tmp_path / "trial").exists()
    assert [line["event"] for line in _log(trial.directory)] == ["started", "looked", "decided"]
    assert json.loads((trial.directory / "result.json").read_text())["status"] == "interrupted"


@pytest.mark.parametrize("error", [PhysicsError("a body flew away"), ZeroDivisionError("a bug")])
def test_what_breaks_is_errored_never_a_failed_retrieval(tmp_path, error):
    def explode(event):
        if isinstance(event, Looked):
            raise error

    trial = run_trial(SPEC, tmp_path / "trial", listeners=[explode], say=_silent)
    assert trial.result.status == "errored"
    assert str(error) in trial.result.error
    assert "retrieved" not in trial.result
    assert "Traceback" in (tmp_path / "trial" / "error.txt").read_text()


def test_a_scene_or_a_robot_that_cannot_be_used_is_bad_input_and_leaves_nothing(tmp_path):
    problem = load_problem("structured-04")
    hung_up = [
        replace(o, position=(1.0, 0.55, 1.5)) if o.name == problem.target else o for o in problem.objects
    ]
    tilted = [replace(o, wxyz=(0.92, 0.39, 0.0, 0.0)) if o.name == problem.target else o for o in hung_up]
    edge = tmp_path / "edge.yaml"
    save_problem(replace(problem, objects=tuple(tilted)), edge)
    for spec in (
        TrialSpec.of(str(edge), "random"),
        TrialSpec.of("no-such-problem", "random"),
        TrialSpec.of("structured-04", "random", robot="no_such_robot"),
    ):
        with pytest.raises(InputError):
            run_trial(spec, tmp_path / "trial", say=_silent)
        assert [p.name for p in tmp_path.iterdir()] == ["edge.yaml"]


def test_only_trials_are_replaced(tmp_path):
    for name in ("precious", "trial.partial"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "thesis.txt").write_text("years of work")
    for name in ("precious", "trial"):
        with pytest.raises(InputError, match="is no trial"):
            run_trial(SPEC, tmp_path / name, overwrite=True, say=_silent)
        assert (tmp_path / "precious" / "thesis.txt").read_text() == "years of work"
        assert (tmp_path / "trial.partial" / "thesis.txt").read_text() == "years of work"
    assert not (tmp_path / "trial").exists()


TABLE_Z = load_workspace().support_z_m


def _standing(name, x, y):
    height = load_object(name).size_m[2]
    return ObjectPlacement(name, name, (x, y, TABLE_Z + height / 2 + 0.001), (1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("max_width_m", [0.078, pytest.param(0.14, marks=pytest.mark.slow)])
def test_a_trial_with_another_gripper_retrieves_the_target(max_width_m, tmp_path):
    robot = write_slides(tmp_path, max_width_m)
    placements = (_standing("soup_can_red", 0.62, -0.12), _standing("milk_carton_small", 0.66, 0.06))
    problem = Problem("own", "structured", "the soup can", "soup_can_red", placements)
    save_problem(problem, tmp_path / "own.yaml")
    spec = TrialSpec.of(str(tmp_path / "own.yaml"), "random", robot=str(robot), max_picks=3)
    result = run_trial(spec, tmp_path / "trial", say=lambda text: None).result
    assert result.status == "completed", result
    assert result.retrieved
