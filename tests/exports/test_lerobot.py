"""The LeRobot dataset: every frame where it belongs; what does not fit is refused; the real library loads it."""

import json
import shutil
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pyarrow.parquet as pq
import pytest

from torc.errors import InputError
from torc.exports.exporting import ExportSpec, export_trials
from torc.exports.lerobot import CAMERA_KEY
from torc.io.record_files import save_record
from torc.trials.trajectory import CAMERA, FPS, TRAJECTORY, RecordedMotion
from torc.trials.video import Mp4Writer

SIZE = 64


def _record(directory, n, rng, joints=("a", "b", "c")):
    """A motion of n frames; the brightness of frame i of the video is 4 i."""
    dof = len(joints)
    motion = RecordedMotion(
        robot="arm",
        joint_names=joints,
        fps=FPS,
        pick=np.repeat(np.arange(2), [n // 2, n - n // 2]).astype(np.int16),
        times_s=np.arange(n) / FPS,
        qpos=rng.normal(size=(n, dof)).astype(np.float32),
        commanded_qpos=rng.normal(size=(n, dof)).astype(np.float32),
        width_m=rng.uniform(0, 0.08, n).astype(np.float32),
        commanded_width_m=rng.uniform(0, 0.08, n).astype(np.float32),
    )
    save_record(motion, directory / TRAJECTORY)
    with Mp4Writer(directory / CAMERA, SIZE, SIZE, Fraction(FPS), {"crf": "10", "g": "5"}) as video:
        for i in range(n):
            video.write(np.full((SIZE, SIZE, 3), 4 * i, np.uint8))
    return motion


@pytest.fixture
def filmed(trials, tmp_path, rng):
    """Trials with motions: of boxes those of oracle and random; directory and motions by planner."""
    root = tmp_path / "trials"
    shutil.copytree(trials, root)
    return root, {
        name: _record(root / "boxes" / name, n, rng) for name, n in (("oracle", 12), ("random", 20))
    }


def test_every_frame_is_there_with_the_command_that_followed_it(filmed, tmp_path):
    root, motions = filmed
    facts = export_trials(root, tmp_path / "out", ExportSpec("lerobot", test_share=0.0))
    assert facts["examples"] == {"train": 2, "test": 0}
    assert facts["trials"] == {"oracle": 1, "random": 1}  # those without a trajectory do not count
    info = json.loads((tmp_path / "out" / "meta" / "info.json").read_text())
    assert (info["total_episodes"], info["total_frames"], info["fps"]) == (2, 32, FPS)
    lines = pq.read_table(tmp_path / "out" / "meta" / "episodes").to_pylist()
    assert [(e["dataset_from_index"], e["dataset_to_index"]) for e in lines] == [(0, 12), (12, 32)]
    for line in lines:
        motion = motions[line["planner"]]
        path = {"chunk_index": line["data/chunk_index"], "file_index": line["data/file_index"]}
        rows = pq.read_table(tmp_path / "out" / info["data_path"].format(**path)).to_pydict()
        assert rows["index"] == list(range(line["dataset_from_index"], line["dataset_to_index"]))
        assert np.array_equal(rows["observation.state"], np.column_stack([motion.qpos, motion.width_m]))
        assert np.array_equal(np.array(rows["action"])[:-1, :3], motion.commanded_qpos[1:])
        assert np.array_equal(np.array(rows["action"])[-1, :3], motion.commanded_qpos[-1])
        assert rows["pick"] == motion.pick.tolist()
        video = tmp_path / "out" / info["video_path"].format(video_key=CAMERA_KEY, **path)
        assert video.read_bytes() == (root / "boxes" / line["planner"] / CAMERA).read_bytes()


def test_statistics_are_those_of_all_frames_and_pandas_reads_the_tasks(filmed, tmp_path):
    pandas = pytest.importorskip("pandas")
    root, motions = filmed
    export_trials(root, tmp_path / "out", ExportSpec("lerobot"))
    stats = json.loads((tmp_path / "out" / "meta" / "stats.json").read_text())
    qpos = np.concatenate([m.qpos for m in motions.values()])
    assert stats["observation.state"]["mean"][:3] == pytest.approx(qpos.mean(0), abs=1e-6)
    assert stats["observation.state"]["std"][:3] == pytest.approx(qpos.std(0), abs=1e-6)
    assert np.array(stats[CAMERA_KEY]["max"]) == pytest.approx(np.full((3, 1, 1), 76 / 255), abs=0.02)
    tasks = pandas.read_parquet(tmp_path / "out" / "meta" / "tasks.parquet")
    assert tasks.iloc[0].name == "Retrieve the small box from the clutter."
    assert tasks.loc["Retrieve the small box from the clutter.", "task_index"] == 0


@pytest.mark.usefixtures("any_arrays")
def test_what_does_not_fit_is_refused(filmed, tmp_path, rng):
    root, _ = filmed
    for name in ("spec", "lost"):
        with pytest.raises(InputError):
            export_trials(root / "boxes" / name, tmp_path / "out", ExportSpec("lerobot"))
    other = root / "boxes" / "random"
    _record(other, 20, rng, joints=("x",))
    with pytest.raises(InputError, match="different robots"):
        export_trials(root, tmp_path / "out", ExportSpec("lerobot"))
    motion = _record(other, 20, rng)
    save_record(replace(motion, fps=1000), other / TRAJECTORY)
    with pytest.raises(InputError, match="not as torc writes them"):
        export_trials(root, tmp_path / "out", ExportSpec("lerobot"))
    _record(other, 20, rng)
    shutil.copy(root / "boxes" / "oracle" / CAMERA, other / CAMERA)
    with pytest.raises(InputError, match="12 frames"):
        export_trials(root, tmp_path / "out", ExportSpec("lerobot"))
    (other / CAMERA).write_bytes(b"no video")
    with pytest.raises(InputError, match="no readable video"):
        export_trials(root, tmp_path / "out", ExportSpec("lerobot"))
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_lerobot_loads_it(filmed, tmp_path, monkeypatch):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    datasets = pytest.importorskip("lerobot.datasets.lerobot_dataset", reason="lerobot is not installed")
    root, motions = filmed
    export_trials(root, tmp_path / "out", ExportSpec("lerobot", test_share=0.0))
    loaded = datasets.LeRobotDataset("local/torc", root=tmp_path / "out", video_backend="pyav")
    assert (loaded.num_frames, loaded.num_episodes) == (32, 2)
    items = [loaded[i] for i in (0, 11, 12, 31)]
    assert [int(item["episode_index"]) for item in items] == [0, 0, 1, 1]
    assert items[0]["task"] == "Retrieve the small box from the clutter."
    rows = [np.column_stack([motions[name].qpos, motions[name].width_m]) for name in ("oracle", "random")]
    states = [item["observation.state"].numpy() for item in items]
    assert np.allclose(states, [rows[0][0], rows[0][11], rows[1][0], rows[1][19]])
    brightness = [float(item[CAMERA_KEY].mean()) * 255 for item in items]
    assert brightness == pytest.approx([0, 44, 0, 76], abs=4)
