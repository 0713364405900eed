"""The tree file and its compiled evaluation."""

from dataclasses import fields, replace

import numpy as np
import pytest

from tools.grasp_model.export import save_trees
from torc.errors import InputError
from torc.grasping.geometric_planner import default_scorer
from torc.grasping.trees import TreeModel, load_trees

NAMES = tuple(f"f{k}" for k in range(5))


def random_model(rng, trees=12, splits=9):
    """Random trees grown by splitting random leaves; children come after their parents."""
    rows = {k: [] for k in ("feature", "threshold", "left", "right", "value", "missing_left")}
    roots = []

    def leaf():
        for name, value in (("feature", -1), ("threshold", 0.0), ("left", 0), ("right", 0)):
            rows[name].append(value)
        rows["value"].append(rng.normal())
        rows["missing_left"].append(False)
        return len(rows["feature"]) - 1

    for _ in range(trees):
        leaves = [leaf()]
        roots.append(leaves[0])
        for _ in range(rng.integers(0, splits)):
            node = leaves.pop(int(rng.integers(len(leaves))))
            left, right = leaf(), leaf()
            rows["feature"][node], rows["threshold"][node] = int(rng.integers(len(NAMES))), rng.normal()
            rows["left"][node], rows["right"][node] = left, right
            rows["missing_left"][node] = bool(rng.random() < 0.5)
            leaves += [left, right]
    kinds = {"feature": np.int32, "left": np.int32, "right": np.int32, "missing_left": bool}
    arrays = {k: np.array(v, dtype=kinds.get(k, float)) for k, v in rows.items()}
    return TreeModel(
        **arrays,
        roots=np.array(roots, dtype=np.int32),
        baseline=0.3,
        feature_names=NAMES,
        knots_p=np.array([0.0, 0.3, 0.7, 1.0]),
        knots_held=np.array([0.1, 0.2, 0.9, 0.95]),
        data_sha256="ab" * 32,
        notes="made up",
    )


def slow_probability(model, row):
    total = model.baseline
    for root in model.roots:
        node = root
        while model.feature[node] >= 0:
            x = row[model.feature[node]]
            left = model.missing_left[node] if np.isnan(x) else x <= model.threshold[node]
            node = model.left[node] if left else model.right[node]
        total += model.value[node]
    return np.interp(1 / (1 + np.exp(-total)), model.knots_p, model.knots_held)


@pytest.mark.parametrize("missing", [0.0, 0.1])
def test_the_kernel_equals_a_slow_walk(rng, missing):
    model = random_model(rng)
    x = rng.normal(size=(200, 5)).astype(np.float32)
    x[0, :] = model.threshold[model.feature >= 0][0]
    x[rng.random(x.shape) < missing] = np.nan
    expected = [slow_probability(model, row) for row in x]
    assert np.allclose(model.score(x), expected)
    assert len(model.score(x[:0])) == 0


def test_features_as_near_to_a_threshold_as_single_precision_can_be(rng):
    model = random_model(rng)
    inner = model.feature >= 0
    near = model.threshold[inner].astype(np.float32)
    x = np.concatenate([near, np.nextafter(near, np.float32(-9)), np.nextafter(near, np.float32(9))])
    x = np.tile(x[:, None], (1, 5))
    assert np.allclose(model.score(x), [slow_probability(model, row) for row in x])


def test_infinite_thresholds_and_features(rng):
    model = random_model(rng)
    odd = np.where(model.feature >= 0, rng.choice([np.inf, -np.inf, 1e300, -1e300], len(model.feature)), 0.0)
    model = replace(model, threshold=odd)
    x = rng.choice(np.array([np.inf, -np.inf, 3e38, -3e38, 0.0, np.nan], np.float32), size=(60, 5))
    assert np.allclose(model.score(x), [slow_probability(model, row) for row in x])


def test_a_saved_model_comes_back_as_it_was(rng, tmp_path):
    model = random_model(rng)
    save_trees(tmp_path / "m.npz", model)
    again = load_trees(tmp_path / "m.npz", NAMES)
    for field in fields(TreeModel):
        assert np.array_equal(getattr(again, field.name), getattr(model, field.name))
    assert [p.name for p in tmp_path.iterdir()] == ["m.npz"]


def test_a_model_for_other_features_is_refused(rng, tmp_path):
    save_trees(tmp_path / "m.npz", random_model(rng))
    with pytest.raises(InputError, match="f9"):
        load_trees(tmp_path / "m.npz", (*NAMES[:4], "f9"))
    with pytest.raises(InputError, match="another order"):
        load_trees(tmp_path / "m.npz", NAMES[::-1])


@pytest.mark.parametrize("content", [b"", b"nonsense", b"PK\x03\x04broken"])
def test_a_damaged_file_is_refused(tmp_path, content):
    (tmp_path / "m.npz").write_bytes(content)
    with pytest.raises(InputError, match="not a grasp model"):
        load_trees(tmp_path / "m.npz", NAMES)


@pytest.mark.parametrize(
    ("name", "value"),
    [("baseline", "text"), ("baseline", [1.0, 2.0]), ("feature_names", 3), ("value", "text")],
)
def test_values_of_another_kind_are_refused(rng, tmp_path, name, value):
    save_trees(tmp_path / "m.npz", random_model(rng))
    arrays = dict(np.load(tmp_path / "m.npz"))
    np.savez(tmp_path / "m.npz", **{**arrays, name: np.array(value)})
    with pytest.raises(InputError, match="not a grasp model"):
        load_trees(tmp_path / "m.npz", NAMES)


def test_pickled_objects_are_not_opened(tmp_path):
    np.savez(tmp_path / "m.npz", version=np.array([{"a": 1}], dtype=object))
    with pytest.raises(InputError, match="not a grasp model"):
        load_trees(tmp_path / "m.npz", NAMES)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda m: {"left": np.where(m.feature >= 0, 0, m.left)}, "does not come after"),
        (lambda m: {"right": np.where(m.feature >= 0, 10**6, m.right)}, "does not come after"),
        (lambda m: {"feature": np.where(m.feature >= 0, 5, m.feature)}, "does not exist"),
        (lambda m: {"roots": m.roots + 10**6}, "outside"),
        (lambda m: {"value": m.value * np.nan}, "not finite"),
        (lambda m: {"left": m.right}, "two parents"),
        (lambda m: {"roots": np.repeat(m.roots, 2)}, "two parents"),
        (lambda m: {"threshold": m.threshold[:-1]}, "differ in length"),
        (lambda m: {"knots_p": m.knots_p[::-1]}, "does not rise"),
        (lambda m: {"knots_held": m.knots_held + 0.5}, "does not rise"),
        (lambda m: {"knots_rough": m.knots_held[::-1]}, "does not rise"),
        (lambda m: {"knots_rough": m.knots_held[1:]}, "does not rise"),
        (lambda m: {"knots_p": m.knots_p[:1], "knots_held": m.knots_held[:1]}, "does not rise"),
    ],
)
def test_unsound_arrays_are_refused(rng, change, why):
    model = random_model(rng)
    with pytest.raises(InputError, match=why):
        replace(model, **change(model))


def test_the_default_is_the_shipped_model():
    assert isinstance(default_scorer(), TreeModel)


def test_rough_depth_has_a_calibration_of_its_own(rng):
    model = random_model(rng)
    model = replace(model, knots_rough=0.1 + 0.5 * model.knots_held)
    x = rng.normal(size=(50, 5)).astype(np.float32)
    np.testing.assert_allclose(model.for_rough_depth().score(x), 0.1 + 0.5 * model.score(x))
    plain = random_model(rng)
    assert np.array_equal(plain.for_rough_depth().score(x), plain.score(x))
