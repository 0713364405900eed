"""From scikit-learn's trees to the package's own data-only file."""

import hashlib
from dataclasses import fields
from pathlib import Path

import numpy as np

from tools.grasp_model.dataset import Trials
from tools.grasp_model.train import Fit
from torc.errors import TorcError
from torc.grasping.trees import MODEL_VERSION, TreeModel, load_trees

MAX_DIFFERENCE = 1e-6
_LEAF = -1


def to_trees(fitted: Fit, data_sha256: str = "", notes: str = "") -> TreeModel:
    """The fitted trees in one table, with their calibration."""
    # scikit-learn exposes the trees of histogram boosting only here; the check in `export` guards against changes.
    nodes = [predictors[0].nodes for predictors in fitted.model._predictors]
    sizes = np.array([len(n) for n in nodes])
    roots = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    shift = np.repeat(roots, sizes)
    table = np.concatenate(nodes)
    leaf = table["is_leaf"].astype(bool)
    return TreeModel(
        feature=np.where(leaf, _LEAF, table["feature_idx"]).astype(np.int32),
        threshold=np.where(leaf, 0.0, table["num_threshold"]).astype(float),
        left=np.where(leaf, 0, table["left"] + shift).astype(np.int32),
        right=np.where(leaf, 0, table["right"] + shift).astype(np.int32),
        value=np.where(leaf, table["value"], 0.0).astype(float),
        missing_left=np.where(leaf, False, table["missing_go_to_left"]).astype(bool),
        roots=roots.astype(np.int32),
        baseline=float(np.ravel(fitted.model._baseline_prediction)[0]),
        feature_names=fitted.feature_names,
        knots_p=fitted.knots_p,
        knots_held=fitted.knots_held,
        data_sha256=data_sha256,
        notes=notes,
    )


def export(fitted: Fit, trials: Trials, path: Path) -> float:
    """Write the model, read it back, and return its largest difference from scikit-learn on the given trials.

    Raises:
        TorcError: the two disagree; the file is removed.
    """
    scenes = len(np.unique(trials.scene_key))
    notes = (
        f"{len(trials)} simulated trials in {scenes} scenes, {100 * trials.delivered.mean():.1f} % delivered"
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    save_trees(path, to_trees(fitted, data_hash(trials), notes))
    ours = load_trees(path, fitted.feature_names).score(trials.features)
    difference = float(np.abs(ours - fitted.predict(trials.features)).max(initial=0.0))
    if difference > MAX_DIFFERENCE:
        path.unlink()
        raise TorcError(
            f"The exported trees differ from scikit-learn's by {difference:.1e}. "
            "This version of scikit-learn stores them otherwise; use another one."
        )
    return difference


def save_trees(path: Path, model: TreeModel) -> None:
    """Write a model, completely or not at all."""
    aside = path.with_name(path.name + ".part")
    arrays = {f.name: np.asarray(getattr(model, f.name)) for f in fields(TreeModel)}
    with aside.open("wb") as file:
        np.savez_compressed(file, version=MODEL_VERSION, **arrays)  # type: ignore[arg-type]
    aside.replace(path)


def data_hash(trials: Trials) -> str:
    """Hash of features and labels."""
    digest = hashlib.sha256(np.ascontiguousarray(trials.features).tobytes())
    digest.update(np.ascontiguousarray(trials.delivered).tobytes())
    return digest.hexdigest()
