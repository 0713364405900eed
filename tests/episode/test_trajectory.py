"""The recorded motion: it changes nothing in the trial, and every row has its frame."""

from dataclasses import replace

import av
import numpy as np
import pytest

from tests.helpers.trial_logs import comparable_log
from torc.episode.trajectory import CAMERA, FPS, TRAJECTORY, RecordedMotion, load_motion
from torc.episode.trial import Recording, run_trial
from torc.errors import InputError
from torc.records.serialization import save_record
from torc.specs.trial import TrialSpec


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
        assert trial.result["status"] == "completed"
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
