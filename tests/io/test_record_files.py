"""Round trips of records through files."""

import json
from dataclasses import make_dataclass

import numpy as np
import pytest

from torc.errors import InputError
from torc.io.record_files import load_record, save_record, to_plain
from torc.records import (
    BACKGROUND,
    Capture,
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


def _observation(rng):
    rgb, depth_m = rng.integers(0, 255, (4, 6, 3), dtype=np.uint8), rng.random((4, 6), dtype=np.float32)
    return Observation(rgb, depth_m, rng.random((3, 3)), np.eye(4), rng.random(7), 0.1 + 0.2)


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
    points, normals = rng.random((2, 5, 3), dtype=np.float32)
    thing = SegmentedObject(3, points, normals, np.zeros((5, 2), np.int32), 7)
    label = np.full((4, 6), BACKGROUND, np.int16)
    yield observation
    yield Capture(observation, label)
    yield Capture(observation)
    nothing = np.zeros((0, 3), np.float32)
    yield SegmentedScene(observation, label, (thing, thing), None, nothing)
    yield PickOutcome(PickResult.MISSED, 4, None, dropped=(1, 2), detail="ü")
    yield PlanFailure(PlanStage.LIFT, "no", 3)
    yield PickPlan(1, 2, np.eye(4), 0.05, *[trajectory] * 5, grasps_tried=1)
    none, ids = np.zeros(0), np.zeros(0, np.int16)
    empty = np.zeros((0, 4, 4)), none, none, ids, np.zeros((0, 2, 3)), np.zeros(0, np.uint8)
    yield GraspSet(*empty, ("slices", "boxes"))


def test_every_record_survives_the_file(tmp_path):
    for i, record in enumerate(_records(np.random.default_rng(0))):
        path = tmp_path / f"{i}.npz"
        save_record(record, path)
        assert _same(record, load_record(path, type(record)))
        assert list(tmp_path.glob("*.tmp")) == []
        json.dumps(to_plain(record))


def test_fields_that_a_record_no_longer_has_are_skipped(tmp_path):
    """As `label_image` in observations of older versions."""
    observation, path = _observation(np.random.default_rng(0)), tmp_path / "old.npz"
    fields = {name: getattr(observation, name) for name in Observation.__dataclass_fields__}
    Old = make_dataclass("Observation", [*fields, "label_image"])
    save_record(Old(**fields, label_image=np.full((4, 6), BACKGROUND, np.int16)), path)
    assert _same(load_record(path, Observation), observation)
    Strange = make_dataclass("Observation", [*fields, "strange"])
    save_record(Strange(**fields, strange=1), path)
    with pytest.raises(InputError, match="unknown fields: strange"):
        load_record(path, Observation)


def test_what_is_no_such_record_is_refused(tmp_path):
    path = tmp_path / "r.npz"
    save_record(PlanFailure(PlanStage.FREE, "x", 1), path)
    with pytest.raises(InputError, match="does not hold a PickOutcome"):
        load_record(path, PickOutcome)
    for content in (b"", b"not a zip", b"PK\x03\x04 broken"):
        path.write_bytes(content)
        with pytest.raises(InputError, match="not a readable"):
            load_record(path, PickOutcome)
    with pytest.raises(TypeError, match="plain data"):
        save_record(PickOutcome(PickResult.MISSED, object()), path)
