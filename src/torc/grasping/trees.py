"""Gradient-boosted trees as plain arrays: a data-only file, and a compiled evaluation.

The file is an `.npz` without pickled objects, so that a model from anyone can be opened without running anything.
"""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Bool, Float, Float32, Int32, UInt32
from numba import njit

from torc.errors import InputError
from torc.geometry.transforms import kernel_array

MODEL_VERSION = 1
_LEAF = -1


class _Nodes(NamedTuple):
    """The nodes as the kernel walks them, level by level, so that both children of a node lie side by side.

    child: the left one, and the right one follows; a leaf's is itself, and nothing is above its threshold.
    missing_right: 1 where NaN goes right.
    levels: steps from a root to the farthest leaf.
    """

    threshold: Float32[np.ndarray, "n"]
    feature: UInt32[np.ndarray, "n"]
    child: UInt32[np.ndarray, "n"]
    missing_right: UInt32[np.ndarray, "n"]
    value: Float[np.ndarray, "n"]
    roots: UInt32[np.ndarray, "t"]
    levels: int


@dataclass(frozen=True)
class TreeModel:
    """A sum of binary trees on the log-odds scale, and a calibration of the resulting probability.

    Nodes of all trees lie in one table; children are indices into it. At an inner node a sample goes left if its
    feature is <= the threshold, or is NaN and `missing_left` is set.

    Attributes:
        feature: column tested at each node; -1 at a leaf.
        threshold: compared with that column.
        left, right: children; 0 at a leaf.
        value: summed over the leaves that are reached.
        missing_left: where NaN goes.
        roots: first node of each tree.
        baseline: log-odds to which the leaves' values are added.
        knots_p, knots_held: calibration, piecewise linear from raw to calibrated probability; both rising.
        knots_rough: replaces knots_held if depth has a sensor's errors; empty for no replacement.
        feature_names: the columns.
        data_sha256: hash of the training data, as text; empty if unknown.
        notes: how it was trained, for people.
    """

    feature: Int32[np.ndarray, "n"]
    threshold: Float[np.ndarray, "n"]
    left: Int32[np.ndarray, "n"]
    right: Int32[np.ndarray, "n"]
    value: Float[np.ndarray, "n"]
    missing_left: Bool[np.ndarray, "n"]
    roots: Int32[np.ndarray, "t"]
    baseline: float
    feature_names: tuple[str, ...]
    knots_p: Float[np.ndarray, "k"] = field(default_factory=lambda: np.array([0.0, 1.0]))
    knots_held: Float[np.ndarray, "k"] = field(default_factory=lambda: np.array([0.0, 1.0]))
    knots_rough: Float[np.ndarray, "k"] = field(default_factory=lambda: np.zeros(0))
    data_sha256: str = ""
    notes: str = ""

    def __post_init__(self) -> None:
        problem = _problem(self)
        if problem:
            raise InputError(f"Unusable grasp model: {problem}. Train it again.")

    def for_rough_depth(self) -> "TreeModel":
        """Return the model calibrated for depth with a sensor's errors."""
        return replace(self, knots_held=self.knots_rough) if len(self.knots_rough) else self

    def score(self, features: Float32[np.ndarray, "n f"]) -> Float[np.ndarray, "n"]:
        """Return the calibrated probability per row."""
        columns = kernel_array(np.transpose(features), np.float32)
        raw = _log_odds(columns, self._nodes, self.baseline)
        return np.interp(1.0 / (1.0 + np.exp(-raw)), self.knots_p, self.knots_held)

    @cached_property
    def _nodes(self) -> _Nodes:
        """The nodes for the kernel."""
        levels, children, count = [self.roots.astype(np.int64)], [], len(self.roots)
        while True:
            ids = levels[-1]
            inner = self.feature[ids] != _LEAF
            child = count - len(ids) + np.arange(len(ids))
            child[inner] = count + 2 * np.arange(np.count_nonzero(inner))
            children.append(child)
            if not inner.any():
                break
            levels.append(np.stack([self.left[ids[inner]], self.right[ids[inner]]], axis=1).ravel())
            count += len(levels[-1])
        order = np.concatenate(levels)
        leaf = self.feature[order] == _LEAF
        return _Nodes(
            threshold=np.where(leaf, np.float32(np.inf), _rounded_down(self.threshold[order])),
            feature=np.where(leaf, 0, self.feature[order]).astype(np.uint32),
            child=np.concatenate(children).astype(np.uint32),
            missing_right=(~leaf & ~self.missing_left[order]).astype(np.uint32),
            value=self.value[order],
            roots=np.arange(len(self.roots), dtype=np.uint32),
            levels=len(levels) - 1,
        )


def _rounded_down(threshold: Float[np.ndarray, "n"]) -> Float32[np.ndarray, "n"]:
    """Return the largest single-precision number not above each: single-precision features then go the same way."""
    with np.errstate(over="ignore"):
        near = threshold.astype(np.float32)
    return np.where(near > threshold, np.nextafter(near, np.float32(-np.inf)), near)


@njit(cache=True, nogil=True)
def _log_odds(columns, nodes, baseline):
    """Return, per row of a table given by its columns, the baseline plus the leaf values of all trees.

    All rows walk a tree side by side, for as many steps as the deepest tree has: no step waits for the one before, no
    branch is mispredicted, and the steps of several rows become one vector instruction.
    """
    threshold, feature, child, missing_right = (
        nodes.threshold,
        nodes.feature,
        nodes.child,
        nodes.missing_right,
    )
    n = columns.shape[1]
    out, at = np.full(n, baseline), np.empty(n, np.uint32)
    for root in nodes.roots:
        at[:] = root
        for _ in range(nodes.levels):
            for i in range(n):
                k = at[i]
                x = columns[feature[k], i]
                at[i] = child[k] + np.uint32(x > threshold[k]) + np.uint32(x != x) * missing_right[k]
        for i in range(n):
            out[i] += nodes.value[at[i]]
    return out


def load_trees(path: Path, feature_names: tuple[str, ...]) -> TreeModel:
    """Read a model that must have been trained on the given features, in any version of this package.

    Raises InputError if the file is damaged, of another version, or for other features.
    """
    try:
        # Opened here: numpy leaves the file open if it is not an archive.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            if int(data["version"]) != MODEL_VERSION:
                raise InputError(f"{path}: model version {int(data['version'])}, this is {MODEL_VERSION}.")
            columns: dict[str, Any] = {f.name: data[f.name] for f in fields(TreeModel)}
        names = columns["feature_names"] = tuple(map(str, columns["feature_names"]))
        for name, kind in (("baseline", float), ("data_sha256", str), ("notes", str)):
            columns[name] = kind(columns[name])
        model = TreeModel(**columns)
    except (OSError, KeyError, TypeError, ValueError, EOFError, BadZipFile) as error:
        raise InputError(f"{path} is not a grasp model ({error}).") from error
    if names != feature_names:
        odd = sorted(set(names) ^ set(feature_names)) or ["the same, in another order"]
        raise InputError(f"{path} was trained on other features ({', '.join(odd[:5])}). Train it again.")
    return model


def _problem(m: TreeModel) -> str:
    """Return the fault in a model's arrays, or "". A sound model cannot make the evaluation run off."""
    n, inner = len(m.feature), m.feature != _LEAF
    if any(len(column) != n for column in (m.threshold, m.left, m.right, m.value, m.missing_left)):
        return "the node arrays differ in length"
    if np.any(m.feature < _LEAF) or np.any(m.feature >= len(m.feature_names)):
        return "a node tests a feature that does not exist"
    children = np.stack([m.left, m.right])[:, inner]
    # Children come after their parents: no cycles.
    if np.any((children <= np.flatnonzero(inner)) | (children >= n)):
        return "a node's child does not come after it"
    if np.any((m.roots < 0) | (m.roots >= n)):
        return "a tree starts outside the table"
    for held in (m.knots_held, m.knots_rough) if len(m.knots_rough) else (m.knots_held,):
        sound = len(held) == len(m.knots_p) >= 2 and held.min() >= 0.0 and held.max() <= 1.0
        if not sound or np.any(np.diff(m.knots_p) <= 0) or np.any(np.diff(held) < 0):
            return "the calibration does not rise within 0..1 over two knots or more"
    inner = m.feature != _LEAF
    referenced = np.concatenate([m.roots, m.left[inner], m.right[inner]])
    if len(np.unique(referenced)) != len(referenced):
        return "a node belongs to two parents"
    if not (np.all(np.isfinite(m.value)) and np.isfinite(m.baseline)) or np.any(np.isnan(m.threshold)):
        return "a value is not finite"
    return ""
