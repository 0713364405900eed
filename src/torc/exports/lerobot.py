"""A LeRobotDataset v3 of recorded trials: an episode per trial, a frame per camera frame.

The files are written here, without the lerobot library, which depends on PyTorch. Each episode has a data file and a
video file: the videos are the trials' own, not encoded anew.
"""

import itertools
import json
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np
from jaxtyping import Float64

from torc.errors import InputError, MissingDependencyError, extra_remedy
from torc.exports.examples import SPLITS, Counts, Source, split_of
from torc.io.results import write_json
from torc.trials.trajectory import CAMERA, TRAJECTORY, RecordedMotion, load_motion

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
    """One trial as an episode; `task` is the robot's task in words, `size` is height and width of the video."""

    source: Source
    split: str
    task: str
    motion: RecordedMotion
    video: Path
    size: tuple[int, int]


def write_lerobot(
    directory: Path, sources: Iterable[Source], test_share: float
) -> tuple[Counts, list[Source]]:
    """Write the dataset of those trials that have a trajectory, the train split first.

    Returns the episodes of each split, and the trials used. Raises InputError: a trajectory or video is damaged, or the
    trials are of different robots.
    """
    found = [_episode(source, test_share) for source in sources if _has_motion(source)]
    episodes = sorted(found, key=lambda e: SPLITS.index(e.split))
    counts = {split: sum(e.split == split for e in episodes) for split in SPLITS}
    if not episodes:
        return counts, []
    if len({(e.motion.robot, e.motion.joint_names, e.size) for e in episodes}) > 1:
        raise InputError("The trials are of different robots or cameras: export them one after another.")
    tasks = sorted({e.task for e in episodes})
    lines: list[dict[str, Any]] = []
    for index, episode in enumerate(episodes):
        first = lines[-1]["dataset_to_index"] if lines else 0
        lines.append(_write_episode(directory, episode, index, first, tasks))
    _write_meta(directory, episodes, lines, tasks, counts)
    return counts, [e.source for e in episodes]


def _features(motion: RecordedMotion) -> dict[str, np.ndarray]:
    """Return what LeRobot's policies see and do, a row per frame.

    Actions are the commands to joints and gripper between a frame and the next one; the last frame repeats its own.
    """
    told = np.column_stack([motion.commanded_qpos, motion.commanded_width_m]).astype(np.float32)
    return {
        "observation.state": np.column_stack([motion.qpos, motion.width_m]).astype(np.float32),
        "action": np.concatenate([told[1:], told[-1:]]),
        "pick": motion.pick.astype(np.int64),
        "timestamp": (np.arange(len(motion)) / motion.fps).astype(np.float32),
    }


def _has_motion(source: Source) -> bool:
    path = source.trial.directory / TRAJECTORY
    return path.is_file() and not path.is_symlink()


def _episode(source: Source, test_share: float) -> _Episode:
    directory = source.trial.directory
    path, video = directory / TRAJECTORY, directory / CAMERA
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
    """Write an episode's data and video; return its line of meta/episodes."""
    motion, n = episode.motion, len(episode.motion)
    place = {"chunk_index": index // _CHUNK, "file_index": index % _CHUNK}
    data = directory / _DATA.format(**place)
    data.parent.mkdir(parents=True, exist_ok=True)
    columns = _features(motion) | {
        "frame_index": np.arange(n),
        "episode_index": np.full(n, index),
        "index": np.arange(first, first + n),
        "task_index": np.full(n, tasks.index(episode.task)),
    }
    arrays = {name: pa.array(rows.ravel()) for name, rows in columns.items()}
    for name in ("observation.state", "action"):
        arrays[name] = pa.FixedSizeListArray.from_arrays(arrays[name], columns[name].shape[1])
    pq.write_table(pa.table(arrays), data)
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
    # Task -> index, in the form in which pandas writes a frame indexed by the task.
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": list(tasks)})
    columns = [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy_type, "metadata": None}
        for name, kind, numpy_type in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ]
    described = {"index_columns": ["task"], "column_indexes": [], "columns": columns}
    pandas = json.dumps(described | {"pandas_version": "2.2.0"})
    pq.write_table(table.replace_schema_metadata({"pandas": pandas}), meta / "tasks.parquet")
    write_json(meta / "stats.json", _statistics(episodes))
    last, motion, size = counts["train"], episodes[0].motion, episodes[0].size
    spans = {"train": f"0:{last}", "test": f"{last}:{len(episodes)}"}
    names = [*motion.joint_names, GRIPPER]
    vector = {"dtype": "float32", "shape": [len(names)], "names": names}
    number = {"dtype": "int64", "shape": [1], "names": None}
    video = {
        "video.height": size[0],
        "video.width": size[1],
        "video.codec": "h264",
        "video.pix_fmt": "yuv420p",
        "video.is_depth_map": False,
        "video.fps": motion.fps,
        "video.channels": 3,
        "has_audio": False,
    }
    axes = ["height", "width", "channels"]
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
        "features": {
            "observation.state": vector,
            "action": vector,
            CAMERA_KEY: {"dtype": "video", "shape": [*size, 3], "names": axes, "info": video},
            "pick": number,
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), number),
        },
    }
    write_json(meta / "info.json", info)


def _statistics(episodes: Sequence[_Episode]) -> dict[str, Any]:
    """Return what policies normalise by: of all frames for vectors, of some frames of each episode for pictures."""
    features = [_features(e.motion) for e in episodes]
    rows = {name: np.concatenate([f[name] for f in features]) for name in features[0]}
    found = {name: _summary(values.reshape(len(values), -1)) for name, values in rows.items()}
    pixels = _summary(np.concatenate([_pixels(e.video) for e in episodes]))
    found[CAMERA_KEY] = {
        k: v if k == "count" else np.reshape(v, (3, 1, 1)).tolist() for k, v in pixels.items()
    }
    return found


def _summary(rows: np.ndarray) -> dict[str, Any]:
    values = rows.astype(np.float64)
    found = {"min": values.min(0), "max": values.max(0), "mean": values.mean(0), "std": values.std(0)}
    found |= {name: np.quantile(values, q, axis=0) for name, q in _QUANTILES.items()}
    return {**{name: value.tolist() for name, value in found.items()}, "count": [len(rows)]}


def _pixels(path: Path) -> Float64[np.ndarray, "p 3"]:
    """Return colours, 0 to 1, of every 16th pixel each way of some frames."""
    with av.open(str(path)) as container:
        every = max(1, container.streams.video[0].frames // _STATISTICS_FRAMES)
        decoded = itertools.islice(container.decode(video=0), 0, None, every)
        frames = [f.to_ndarray(format="rgb24")[::16, ::16].reshape(-1, 3) for f in decoded]
    return np.concatenate(frames).astype(np.float64) / 255.0
