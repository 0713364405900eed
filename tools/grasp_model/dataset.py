"""The table of grasp trials, and its shards on disk.

A shard holds the trials of a run of consecutive scenes. It is written aside and renamed when complete, so that a
shard that is there is whole; a collection that was interrupted goes on after the last scene of its last shard.
"""

import json
import os
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, Int32, Int64, UInt8

from torc.errors import InputError
from torc.problems.problem import ObjectPlacement, Problem

SHARD_VERSION = 3
_SHARD_NAME = re.compile(r"trials-(\d{6})-(\d{6})\.npz")


class Cause(IntEnum):
    """How a trial ended: the first thing that went wrong, or DELIVERED."""

    DELIVERED = 0
    STOPPED = 1
    """Unexpected contact ended the approach more than the tolerance short of the grasp."""
    MISSED = 2
    """The pads did not both touch the object once closed: squirted out, or never between them."""
    SLIPPED_AT_LIFT = 3
    SLIPPED_IN_TRANSPORT = 4
    BROKEN = 5
    """The physics broke: a body too fast. Such trials are kept for inspection but never trained on."""


class Policy(IntEnum):
    """Why this grasp was tried."""

    SPREAD = 0
    """Drawn evenly over the ranks of the hand-written score."""
    TOP_HAND = 1
    """The best valid one by the hand-written score."""
    RANDOM = 2
    """Any valid one, with equal chances."""
    INVALID = 3
    """One that a validity check rejects; tried rarely, to know what the checks cost."""
    TOP_MODEL = 4
    """The best valid one by a trained model."""


@dataclass(frozen=True)
class Trials:
    """Grasp trials, one row each.

    Attributes:
        features: inputs of the score, in the order of feature_names.
        feature_names: names of the features.
        delivered: the label.
        cause: a Cause each.
        policy: a Policy each.
        scene: number of the scene within its collection; with the seed it gives the scene again.
        stage: how many objects had been taken away before the snapshot.
        seed: seed of the collection.
        object_id: the object to be grasped, by the id that it was seen under.
        kind: its kind.
        structured: an arrangement of standing objects rather than a dumped pile.
        held_out: its kind belongs to those that no training scene contains.
        eyes: an `Eyes` each: which depth and whose masks the snapshot was seen with.
        valid: the gripper alone passes all checks of validity.
        generator: index of the generator that proposed the grasp.
        p_hand: hand-written score.
        T_world_tcp: grasp pose.
        width_m: expected distance between the pads when closed.
        pixel_count: visible pixels of the object.
        others_moved: other objects that moved more than 2 cm.
        others_dropped: other objects that left the table.
    """

    features: Float32[np.ndarray, "n f"]
    feature_names: tuple[str, ...]
    delivered: Bool[np.ndarray, "n"]
    cause: UInt8[np.ndarray, "n"]
    policy: UInt8[np.ndarray, "n"]
    scene: Int64[np.ndarray, "n"]
    stage: UInt8[np.ndarray, "n"]
    seed: Int64[np.ndarray, "n"]
    object_id: Int16[np.ndarray, "n"]
    kind: np.ndarray
    structured: Bool[np.ndarray, "n"]
    held_out: Bool[np.ndarray, "n"]
    eyes: UInt8[np.ndarray, "n"]
    valid: Bool[np.ndarray, "n"]
    generator: UInt8[np.ndarray, "n"]
    p_hand: Float32[np.ndarray, "n"]
    T_world_tcp: Float[np.ndarray, "n 4 4"]
    width_m: Float32[np.ndarray, "n"]
    pixel_count: Int32[np.ndarray, "n"]
    others_moved: UInt8[np.ndarray, "n"]
    others_dropped: UInt8[np.ndarray, "n"]

    def __len__(self) -> int:
        return len(self.delivered)

    def __getitem__(self, index: np.ndarray) -> "Trials":
        """The rows of an index or mask."""
        columns = {name: getattr(self, name)[index] for name in column_names()}
        return Trials(feature_names=self.feature_names, **columns)

    @property
    def scene_key(self) -> Int64[np.ndarray, "n"]:
        """One number per scene, over all collections: what folds and bootstraps go by."""
        return self.seed * 1_000_000 + self.scene

    @property
    def object_key(self) -> Int64[np.ndarray, "n"]:
        """One number per object, scene and snapshot: the choice that a planner makes."""
        return (self.scene_key * 64 + self.stage) * 64 + self.object_id


def column_names() -> tuple[str, ...]:
    """Names of the columns of `Trials`: all attributes but feature_names."""
    return tuple(f.name for f in fields(Trials) if f.name != "feature_names")


def concatenate(parts: Sequence[Trials]) -> Trials:
    """All rows of several tables. Raises InputError if there are none or their features differ."""
    if not parts:
        raise InputError("No trials. Run `python -m tools.grasp_model collect` first.")
    names = parts[0].feature_names
    for part in parts:
        if part.feature_names != names:
            odd = sorted(set(part.feature_names) ^ set(names)) or ["the same ones in another order"]
            raise InputError(
                f"The shards were collected with different features ({', '.join(odd[:5])}). "
                "Collect anew with one version, or recompute the features of the older ones."
            )
    columns = {name: np.concatenate([getattr(p, name) for p in parts]) for name in column_names()}
    return Trials(feature_names=names, **columns)


def save_shard(directory: Path, trials: Trials, first_scene: int, last_scene: int) -> Path:
    """Write the trials of scenes first_scene..last_scene; complete or not at all."""
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / f"trials-{first_scene:06d}-{last_scene:06d}.npz"
    aside = path.with_suffix(f".{os.getpid()}.part")
    columns = {name: getattr(trials, name) for name in column_names()}
    with aside.open("wb") as file:
        np.savez_compressed(
            file,
            version=SHARD_VERSION,
            feature_names=np.array(trials.feature_names, dtype=np.str_),
            **columns,
        )
        file.flush()
        os.fsync(file.fileno())
    aside.replace(path)
    return path


def load_shard(path: Path) -> Trials:
    """Read one shard. Raises InputError if it is none, or of another version."""
    try:
        with np.load(path, allow_pickle=False) as data:
            version = int(data["version"])
            if version != SHARD_VERSION:
                raise InputError(f"{path} has version {version}, this is {SHARD_VERSION}. Collect anew.")
            columns = {name: data[name] for name in column_names()}
            return Trials(feature_names=tuple(str(s) for s in data["feature_names"]), **columns)
    except (OSError, KeyError, ValueError) as error:
        raise InputError(
            f"{path} is not a shard of grasp trials ({error}). Delete it and collect again."
        ) from error


def scenes_path(shard: Path) -> Path:
    """The file beside a shard that says which objects lay where in each snapshot."""
    return shard.with_name(shard.name.replace("trials-", "scenes-")).with_suffix(".json")


def save_scenes(directory: Path, scenes: dict[str, Problem], first_scene: int, last_scene: int) -> None:
    """Write the scenes of a shard, by "scene/stage"; to be called before `save_shard`."""
    directory.mkdir(parents=True, exist_ok=True)
    path = scenes_path(directory / f"trials-{first_scene:06d}-{last_scene:06d}.npz")
    aside = path.with_suffix(f".{os.getpid()}.part")
    aside.write_text(json.dumps({key: asdict(problem) for key, problem in scenes.items()}))
    aside.replace(path)


def load_scenes(shard: Path) -> dict[str, Problem]:
    """The scenes of a shard, by "scene/stage". Raises InputError if the file is missing or damaged."""
    path = scenes_path(shard)
    try:
        return {key: _problem(fields) for key, fields in json.loads(path.read_text()).items()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path} does not hold the scenes of {shard.name} ({error}). Collect again."
        ) from error


def _problem(fields: dict[str, Any]) -> Problem:
    objects = tuple(
        ObjectPlacement(o["name"], o["model"], tuple(o["position"]), tuple(o["wxyz"]))
        for o in fields["objects"]
    )
    return Problem(**{**fields, "objects": objects})


def shard_ranges(directory: Path) -> list[tuple[int, int, Path]]:
    """First scene, last scene and path of every complete shard, by rising scene."""
    found = []
    for path in directory.glob("trials-*.npz"):
        match = _SHARD_NAME.fullmatch(path.name)
        if match:
            found.append((int(match[1]), int(match[2]), path))
    return sorted(found)


def load_trials(directories: Sequence[Path]) -> Trials:
    """All sound trials below the given directories, those with broken physics left out.

    Raises InputError if there are none.
    """
    parts = [load_shard(path) for d in directories for _, _, path in shard_ranges(Path(d))]
    trials = concatenate([p for p in parts if len(p)])
    return trials[trials.cause != Cause.BROKEN]
