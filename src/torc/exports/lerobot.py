"""A LeRobotDataset v3 of recorded trials: an episode per trial, a frame per camera frame.

The files are written here, without the lerobot library, which brings PyTorch along. A data file and a video file per
episode: the videos are the trials' own, not encoded anew.
"""

import json
import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np
from jaxtyping import Float32, Float64

from torc.episode.trajectory import CAMERA, TRAJECTORY, RecordedMotion, load_motion
from torc.errors import InputError, MissingDependencyError, extra_remedy
from torc.exports.selection import SPLITS, Source, split_of
from torc.records.files import write_json

try:
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError as error:
    raise MissingDependencyError(
        "The library pyarrow, which writes LeRobot's files,", extra_remedy("export")
    ) from error

CODEBASE_VERSION = "v3.0"
CAMERA_KEY = "observation.images.torso"
GRIPPER = "gripper_width_m"
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_DATA, _VIDEO = f"data/{_FILE}.parquet", f"videos/{{video_key}}/{_FILE}.mp4"
_CHUNK = 1000
_STATISTICS_FRAMES = 40
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


@dataclass(frozen=True)
class _Episode:
    """One trial as an episode; `task` says what the robot was to do, `size` is height and width of the video."""

    source: Source
    split: str
    task: str
    motion: RecordedMotion
    video: Path
    size: tuple[int, int]


def write_lerobot(directory: Path, sources: Iterable[Source], test_share: float) -> dict[str, int]:
    """Writes the dataset of those trials that have a trajectory, the train split first; episodes per split.

    Raises InputError: a trajectory or video is damaged, or the trials are of different robots.
    """
    found = [e for source in sources if (e := _episode(source, test_share)) is not None]
    episodes = sorted(found, key=lambda e: SPLITS.index(e.split))
    counts = {split: sum(e.split == split for e in episodes) for split in SPLITS}
    if not episodes:
        return counts
    if len({(e.motion.robot, e.motion.joint_names, e.size) for e in episodes}) > 1:
        raise InputError("The trials are of different robots or cameras: export them one after another.")
    tasks = sorted({e.task for e in episodes})
    lines: list[dict[str, Any]] = []
    for index, episode in enumerate(episodes):
        first = lines[-1]["dataset_to_index"] if lines else 0
        lines.append(_write_episode(directory, episode, index, first, tasks))
    _write_meta(directory, episodes, lines, tasks, counts)
    return counts


def state_of(motion: RecordedMotion) -> Float32[np.ndarray, "n d"]:
    """Joint positions and the gripper's width, per frame."""
    return np.column_stack([motion.qpos, motion.width_m]).astype(np.float32)


def action_of(motion: RecordedMotion) -> Float32[np.ndarray, "n d"]:
    """What joints and gripper were told between a frame and the next one; the last frame repeats its own command."""
    told = np.column_stack([motion.commanded_qpos, motion.commanded_width_m]).astype(np.float32)
    return np.concatenate([told[1:], told[-1:]])


def _episode(source: Source, test_share: float) -> _Episode | None:
    directory = source.trial.directory
    path, video = directory / TRAJECTORY, directory / CAMERA
    if not path.is_file() or path.is_symlink():
        return None
    motion = load_motion(path)
    if not video.is_file() or video.is_symlink():
        raise InputError(f"'{directory}' has a trajectory but no {CAMERA}. Play the trial again.")
    try:
        with av.open(str(video)) as container:
            stream = container.streams.video[0]
            frames, size = stream.frames, (stream.height, stream.width)
    except (av.FFmpegError, IndexError) as error:
        raise InputError(f"'{video}' is no readable video: {error}") from error
    if frames != len(motion):
        raise InputError(
            f"'{video}' has {frames} frames, its trajectory {len(motion)}. Play the trial again."
        )
    target = source.trial.started.target_description if source.trial.started is not None else ""
    task = f"Retrieve {target or 'the target'} from the clutter."
    return _Episode(source, split_of(source.problem, test_share), task, motion, video, size)


def _write_episode(
    directory: Path, episode: _Episode, index: int, first: int, tasks: Sequence[str]
) -> dict[str, Any]:
    """Its data and video; returns its line of meta/episodes."""
    motion, n = episode.motion, len(episode.motion)
    place = {"chunk_index": index // _CHUNK, "file_index": index % _CHUNK}
    data = directory / _DATA.format(**place)
    data.parent.mkdir(parents=True, exist_ok=True)
    columns = {
        "observation.state": _vectors(state_of(motion)),
        "action": _vectors(action_of(motion)),
        "pick": pa.array(motion.pick.astype(np.int64)),
        "timestamp": pa.array(_timestamps(motion)),
        "frame_index": pa.array(np.arange(n)),
        "episode_index": pa.array(np.full(n, index)),
        "index": pa.array(np.arange(first, first + n)),
        "task_index": pa.array(np.full(n, tasks.index(episode.task))),
    }
    pq.write_table(pa.table(columns), data)
    video = directory / _VIDEO.format(video_key=CAMERA_KEY, **place)
    video.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(episode.video, video)
    return {
        "episode_index": index,
        "tasks": [episode.task],
        "length": n,
        "dataset_from_index": first,
        "dataset_to_index": first + n,
        **{f"data/{k}": v for k, v in place.items()},
        **{f"videos/{CAMERA_KEY}/{k}": v for k, v in place.items()},
        f"videos/{CAMERA_KEY}/from_timestamp": 0.0,
        f"videos/{CAMERA_KEY}/to_timestamp": n / motion.fps,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
        "problem": episode.source.problem,
        "planner": episode.source.trial.spec.planner.name,
        "seed": episode.source.trial.spec.seed,
        "retrieved": episode.source.retrieved,
    }


def _timestamps(motion: RecordedMotion) -> Float32[np.ndarray, "n"]:
    return (np.arange(len(motion)) / motion.fps).astype(np.float32)


def _vectors(rows: Float32[np.ndarray, "n d"]) -> pa.FixedSizeListArray:
    return pa.FixedSizeListArray.from_arrays(pa.array(rows.ravel()), rows.shape[1])


def _write_meta(
    directory: Path,
    episodes: Sequence[_Episode],
    lines: list[dict[str, Any]],
    tasks: Sequence[str],
    counts: dict[str, int],
) -> None:
    meta = directory / "meta"
    (meta / "episodes" / "chunk-000").mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(lines), meta / "episodes" / "chunk-000" / "file-000.parquet")
    pq.write_table(_task_table(tasks), meta / "tasks.parquet")
    write_json(meta / "stats.json", _statistics(episodes))
    last, motion = counts["train"], episodes[0].motion
    spans = {"train": f"0:{last}", "test": f"{last}:{len(episodes)}"}
    info = {
        "codebase_version": CODEBASE_VERSION,
        "robot_type": motion.robot,
        "total_episodes": len(episodes),
        "total_frames": lines[-1]["dataset_to_index"],
        "total_tasks": len(tasks),
        "chunks_size": _CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": motion.fps,
        "splits": {split: span for split, span in spans.items() if counts[split]},
        "data_path": _DATA,
        "video_path": _VIDEO,
        "features": _features(motion, episodes[0].size),
    }
    write_json(meta / "info.json", info)


def _features(motion: RecordedMotion, size: tuple[int, int]) -> dict[str, Any]:
    names = [*motion.joint_names, GRIPPER]
    vector = {"dtype": "float32", "shape": [len(names)], "names": names}
    number = {"dtype": "int64", "shape": [1], "names": None}
    info = {
        "video.height": size[0],
        "video.width": size[1],
        "video.codec": "h264",
        "video.pix_fmt": "yuv420p",
        "video.is_depth_map": False,
        "video.fps": motion.fps,
        "video.channels": 3,
        "has_audio": False,
    }
    names = ["height", "width", "channels"]
    return {
        "observation.state": vector,
        "action": vector,
        CAMERA_KEY: {"dtype": "video", "shape": [*size, 3], "names": names, "info": info},
        "pick": number,
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), number),
    }


def _task_table(tasks: Sequence[str]) -> pa.Table:
    """Task -> index as pandas writes a frame that is indexed by the task: so it is read."""
    columns = [
        {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"},
        {"name": "task", "field_name": "task", "pandas_type": "unicode", "numpy_type": "object"},
    ]
    described = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [{**column, "metadata": None} for column in columns],
        "pandas_version": "2.2.0",
    }
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": list(tasks)})
    return table.replace_schema_metadata({"pandas": json.dumps(described)})


def _statistics(episodes: Sequence[_Episode]) -> dict[str, Any]:
    """What policies normalise by: of all frames for vectors, of some frames of each episode for pictures."""
    columns: dict[str, Callable[[RecordedMotion], np.ndarray]] = {
        "observation.state": state_of,
        "action": action_of,
        "pick": lambda motion: motion.pick[:, None],
        "timestamp": lambda motion: _timestamps(motion)[:, None],
    }
    found = {name: _summary(np.concatenate([of(e.motion) for e in episodes])) for name, of in columns.items()}
    pictures = _summary(np.concatenate([_pixels(e.video) for e in episodes]))
    shaped = {
        name: np.reshape(value, (3, 1, 1)).tolist() for name, value in pictures.items() if name != "count"
    }
    return {**found, CAMERA_KEY: {**shaped, "count": pictures["count"]}}


def _summary(rows: np.ndarray) -> dict[str, Any]:
    values = rows.astype(np.float64)
    found = {"min": values.min(0), "max": values.max(0), "mean": values.mean(0), "std": values.std(0)}
    found |= {name: np.quantile(values, q, axis=0) for name, q in _QUANTILES.items()}
    return {**{name: value.tolist() for name, value in found.items()}, "count": [len(rows)]}


def _pixels(path: Path) -> Float64[np.ndarray, "p 3"]:
    """Colors, 0 to 1, of every 16th pixel each way of some frames."""
    with av.open(str(path)) as container:
        every = max(1, container.streams.video[0].frames // _STATISTICS_FRAMES)
        frames = [
            f.to_ndarray(format="rgb24")[::16, ::16].reshape(-1, 3)
            for i, f in enumerate(container.decode(video=0))
            if i % every == 0
        ]
    return np.concatenate(frames).astype(np.float64) / 255.0
