"""Round trips of records through files."""

import json

import numpy as np
import pytest

from torc.errors import InputError
from torc.records import (
    BACKGROUND,
    GraspSet,
    Observation,
    PickOutcome,
    PickPlan,
    PickResult,
    PlanFailure,
    PlanStage,
    SegmentedObject,
    SegmentedScene,
    Trajectory,
)
from torc.records.serialization import load_record, save_record, to_plain


def _observation(rng, with_labels=True):
    labels = np.full((4, 6), BACKGROUND, np.int16) if with_labels else None
    return Observation(
        rgb=rng.integers(0, 255, (4, 6, 3), dtype=np.uint8),
        depth_m=rng.random((4, 6), dtype=np.float32),
        K=rng.random((3, 3)),
        T_world_camera=np.eye(4),
        qpos=rng.random(7),
        stamp_s=0.1 + 0.2,
        label_image=labels,
    )


def _same(a, b):
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and np.array_equal(a, b)
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(_same(getattr(a, f), getattr(b, f)) for f in a.__dataclass_fields__)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    return type(a) is type(b) and a == b


def _records(rng):
    trajectory = Trajectory(np.arange(3.0), rng.random((3, 7)), rng.random((3, 7)))
    observation = _observation(rng)
    thing = SegmentedObject(
        3,
        rng.random((5, 3), dtype=np.float32),
        rng.random((5, 3), dtype=np.float32),
        np.zeros((5, 2), np.int32),
        7,
    )
    yield observation
    yield _observation(rng, with_labels=False)
    yield SegmentedScene(
        observation, observation.label_image, (thing, thing), None, np.zeros((0, 3), np.float32)
    )
    yield PickOutcome(PickResult.MISSED, 4, None, dropped=(1, 2), detail="ü")
    yield PlanFailure(PlanStage.LIFT, "no", 3)
    yield PickPlan(1, 2, np.eye(4), 0.05, *[trajectory] * 5, grasps_tried=1)
    yield GraspSet(
        np.zeros((0, 4, 4)),
        np.zeros(0),
        np.zeros(0),
        np.zeros(0, np.int16),
        np.zeros((0, 2, 3)),
        np.zeros(0, np.uint8),
        ("slices", "boxes"),
    )


def test_every_record_survives_the_file(tmp_path):
    for i, record in enumerate(_records(np.random.default_rng(0))):
        path = tmp_path / f"{i}.npz"
        save_record(record, path)
        assert _same(record, load_record(path, type(record)))
        assert list(tmp_path.glob("*.tmp")) == []


def test_plain_form_is_json(tmp_path):
    for record in _records(np.random.default_rng(1)):
        json.dumps(to_plain(record))


def test_another_record_is_refused(tmp_path):
    save_record(PlanFailure(PlanStage.FREE, "x", 1), tmp_path / "r.npz")
    with pytest.raises(InputError, match="does not hold a PickOutcome"):
        load_record(tmp_path / "r.npz", PickOutcome)


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04 broken"])
def test_damaged_files_are_refused(tmp_path, content):
    (tmp_path / "r.npz").write_bytes(content)
    with pytest.raises(InputError, match="not a readable record"):
        load_record(tmp_path / "r.npz", PickOutcome)


def test_objects_that_are_not_data_are_refused(tmp_path):
    with pytest.raises(TypeError, match="plain data"):
        save_record(PickOutcome(PickResult.MISSED, object()), tmp_path / "r.npz")
