"""What is kept of a pick agrees with what the planner saw."""

from dataclasses import fields, is_dataclass, replace

import av
import numpy as np
import pytest

from tests.helpers.trial_logs import comparable_log
from torc.errors import InputError
from torc.io.record_files import save_record
from torc.records import GraspStatus
from torc.specs.trial import TrialSpec
from torc.task_planning.graph_building import build_dependency_graph
from torc.testing.contexts import behind_context, cluttered_context, empty_context, hidden_context
from torc.trials.pick_view import load_view, view_of
from torc.trials.trajectory import CAMERA, FPS, TRAJECTORY, RecordedMotion, load_motion
from torc.trials.trial import Recording, run_trial


def assert_same(a, b):
    if is_dataclass(a):
        for f in fields(a):
            assert_same(getattr(a, f.name), getattr(b, f.name))
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, tuple | list):
        assert len(a) == len(b)
        for x, y in zip(a, b):
            assert_same(x, y)
    else:
        assert a == b


@pytest.mark.parametrize(
    "make", [behind_context, hidden_context, empty_context, lambda: cluttered_context(9, 4)]
)
def test_a_view_is_the_same_again_and_survives_the_disk(make, tmp_path):
    context = make()
    view = view_of(context)
    assert_same(view, view_of(context))
    save_record(view, tmp_path / "view.npz")
    assert_same(load_view(tmp_path / "view.npz"), view)


def test_the_facts_are_those_of_the_report():
    context = cluttered_context(12, 2)
    view, report = view_of(context), context.report
    assert tuple(o.id for o in view.objects) == context.scene.ids
    for o, valid, blocked in zip(view.objects, report.valid_total, report.blocked_total):
        assert o.statuses.get("valid", 0) == valid
        assert o.statuses.get("blocked", 0) == blocked
        assert (o.best_score is None) == (valid == 0)
        of_it = zip(context.grasps.object_ids, context.grasps.scores, report.status)
        assert o.likely_if_free == sum(
            k == o.id and status == GraspStatus.BLOCKED and score >= 0.25 for k, score, status in of_it
        )
        assert o.hidden_volume_m3 == pytest.approx(context.volume.hidden_volume_m3(o.id))
        row = report.blocking[report.object_ids.index(o.id)]
        assert {int(k): n for k, n in o.blockers.items()} == {
            k: n for k, n in zip(report.object_ids, row.tolist()) if n
        }
    assert view.graph == build_dependency_graph(context).to_dict()


def test_the_unseen_voxels_are_all_there_with_who_hides_them():
    context = cluttered_context(8, 1)
    unseen, volume = view_of(context).unseen, context.volume
    rebuilt = np.zeros_like(volume.hidden_by)
    seen = np.ones_like(volume.seen)
    place = tuple(unseen.index.astype(int).T)
    rebuilt[place], seen[place] = unseen.hiders[unseen.hider], False
    np.testing.assert_array_equal(seen, volume.seen)
    np.testing.assert_array_equal(rebuilt, volume.hidden_by)


def _motion(n=4):
    rows, two = np.zeros(n, np.float32), np.zeros((n, 2), np.float32)
    return RecordedMotion(
        "arm", ("a", "b"), FPS, rows.astype(np.int16), rows.astype(np.float64), two, two, rows, rows
    )


@pytest.mark.usefixtures("any_arrays")
def test_a_motion_comes_back_as_it_went_and_damaged_ones_are_refused(tmp_path):
    path = tmp_path / TRAJECTORY
    save_record(_motion(), path)
    assert len(load_motion(path)) == 4
    good = _motion()
    for bad in (replace(good, width_m=good.width_m + np.nan), replace(good, fps=1000), _motion(0)):
        save_record(bad, path)
        with pytest.raises(InputError, match="no trajectory"):
            load_motion(path)
    path.write_text("nothing")
    with pytest.raises(InputError, match="not a readable"):
        load_motion(path)


@pytest.mark.slow
def test_it_shows_the_trial_and_does_not_change_it(tmp_path, robot):
    spec = TrialSpec.of("structured-04", "dg-select", seed=3, max_picks=1)
    logs = []
    for name, filmed in (("plain", False), ("filmed", True)):
        trial = run_trial(
            spec, tmp_path / name, recording=Recording(trajectory=filmed), say=lambda text: None
        )
        assert trial.result.status == "completed"
        logs.append(comparable_log(trial.directory))
    assert logs[0] == logs[1]
    motion = load_motion(tmp_path / "filmed" / TRAJECTORY)
    with av.open(str(tmp_path / "filmed" / CAMERA)) as container:
        assert sum(1 for _ in container.decode(video=0)) == len(motion)
    assert np.diff(motion.times_s) == pytest.approx(1 / FPS, abs=1e-9)
    assert motion.times_s[-1] - motion.times_s[0] == pytest.approx(logs[0][4]["duration_s"], abs=0.1)
    assert motion.qpos[0] == pytest.approx(robot.arm.rest_qpos, abs=0.02)
    assert np.abs(motion.qpos - motion.commanded_qpos).max() < 0.1
    assert motion.width_m.max() == pytest.approx(robot.gripper.max_width_m, abs=0.002)
    closed = motion.commanded_width_m < 0.001
    assert closed.any()
    planned = next(line for line in logs[0] if line["event"] == "planned")
    assert np.median(motion.width_m[closed]) == pytest.approx(planned["width_m"], abs=0.02)
