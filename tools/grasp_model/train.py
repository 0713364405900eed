"""Fitting the grasp score: gradient-boosted trees, then isotonic calibration on out-of-fold predictions.

Folds are by scene: grasps of one scene share objects, poses and snapshot. Boosted trees are over-confident below
.9 on this task, hence the calibration; it is fitted on predictions that no tree has seen the answer of.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.isotonic import IsotonicRegression
from threadpoolctl import threadpool_limits

from tools.grasp_model.dataset import Trials
from torc.errors import InputError


@dataclass(frozen=True)
class TrainConfig:
    """Settings of the fit.

    Attributes:
        trees: boosting rounds. 250 trees of 15 leaves do for 7,000 trials; at 20,000 these gain .005 of AUC.
        leaves: leaves per tree.
        depth: deepest leaf; evaluation takes this many steps per tree, whatever the tree.
        learning_rate: shrinkage.
        min_leaf: fewest trials in a leaf.
        l2: ridge on the leaf values.
        folds: folds by scene, for calibration and the reported scores.
        seed: of the binning and the folds.
    """

    trees: int = 400
    leaves: int = 31
    depth: int | None = 8
    learning_rate: float = 0.05
    min_leaf: int = 30
    l2: float = 5.0
    folds: int = 5
    seed: int = 0


@dataclass(frozen=True)
class Fit:
    """A fitted score.

    Attributes:
        model: trees fitted on all trials.
        knots_p, knots_held: the calibration, a rising piecewise linear map from raw to calibrated probability.
        p_raw: raw out-of-fold probability of each training trial.
        p: calibrated out-of-fold probability; the calibration itself is cross-fitted too.
        feature_names: order of the inputs.
    """

    model: HistGradientBoostingClassifier
    knots_p: Float[np.ndarray, "k"]
    knots_held: Float[np.ndarray, "k"]
    p_raw: Float[np.ndarray, "n"]
    p: Float[np.ndarray, "n"]
    feature_names: tuple[str, ...]

    def predict_raw(self, features: np.ndarray) -> Float[np.ndarray, "n"]:
        """Probability before calibration."""
        return raw_probability(self.model, features)

    def predict(self, features: np.ndarray) -> Float[np.ndarray, "n"]:
        """Calibrated probability that the object is delivered."""
        return np.interp(self.predict_raw(features), self.knots_p, self.knots_held)


def fit_trees(
    features: np.ndarray, held: Bool[np.ndarray, "n"], config: TrainConfig
) -> HistGradientBoostingClassifier:
    """Boosted trees; on one thread, as waiting threads are slower than none where cores are shared."""
    model = HistGradientBoostingClassifier(
        max_iter=config.trees,
        max_leaf_nodes=config.leaves,
        max_depth=config.depth,
        learning_rate=config.learning_rate,
        min_samples_leaf=config.min_leaf,
        l2_regularization=config.l2,
        early_stopping=False,
        random_state=config.seed,
    )
    with threadpool_limits(1):
        return model.fit(features, held)


def raw_probability(model: HistGradientBoostingClassifier, features: np.ndarray) -> Float[np.ndarray, "n"]:
    """Uncalibrated probability per row."""
    with threadpool_limits(1):
        return model.predict_proba(features)[:, 1]


def fold_of(groups: Int64[np.ndarray, "n"], folds: int, seed: int) -> Int64[np.ndarray, "n"]:
    """Fold of each row: whole groups, dealt out evenly in random order. Raises InputError for too few groups."""
    unique, index = np.unique(groups, return_inverse=True)
    if len(unique) < folds:
        raise InputError(f"{len(unique)} scenes are too few for {folds} folds. Collect more scenes.")
    deal = np.random.default_rng(seed).permutation(len(unique)) % folds
    return deal[index]


def isotonic_knots(p: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rising piecewise linear map fitted to (p, held), over [0, 1].

    A pool of few trials at an end would claim 0 or 1: half a success and half a failure are added at both ends.
    """
    x = np.concatenate([p, [p.min(), p.min(), p.max(), p.max()]])
    y = np.concatenate([held.astype(float), [0, 1, 0, 1]])
    weight = np.concatenate([np.ones(len(p)), np.full(4, 0.5)])
    iso = IsotonicRegression(y_min=0.0, y_max=1.0, out_of_bounds="clip").fit(x, y, sample_weight=weight)
    kx, ky = np.asarray(iso.X_thresholds_, float), np.asarray(iso.y_thresholds_, float)
    kx, ky = _strictly_rising(kx, ky)
    return np.concatenate([[0.0], kx, [1.0]]), np.concatenate([[ky[0]], ky, [ky[-1]]])


def _strictly_rising(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Knots without repeated or boundary abscissas; flat steps get a slight slope so that ranks survive."""
    keep = (x > 0) & (x < 1)
    x, y = x[keep], y[keep]
    x, first = np.unique(x, return_index=True)
    return x, np.clip(y[first] + 1e-6 * (x - x.mean()), 0.0, 1.0)


def fit(trials: Trials, config: TrainConfig) -> Fit:
    """Trees on all trials and a calibration from out-of-fold predictions.

    Raises InputError for too few scenes or a single outcome.
    """
    if trials.delivered.all() or not trials.delivered.any():
        raise InputError(f"All {len(trials)} trials ended alike; nothing to learn. Collect more scenes.")
    fold = fold_of(trials.scene_key, config.folds, config.seed)
    p_raw = out_of_fold(trials.features, trials.delivered, fold, config)
    p = np.empty_like(p_raw)
    for k in range(config.folds):
        rest = fold != k
        p[~rest] = np.interp(p_raw[~rest], *isotonic_knots(p_raw[rest], trials.delivered[rest]))
    knots_p, knots_held = isotonic_knots(p_raw, trials.delivered)
    model = fit_trees(trials.features, trials.delivered, config)
    return Fit(model, knots_p, knots_held, p_raw, p, trials.feature_names)


def out_of_fold(
    features: np.ndarray, held: Bool[np.ndarray, "n"], fold: Int64[np.ndarray, "n"], config: TrainConfig
) -> Float[np.ndarray, "n"]:
    """Raw probability of each row from a model fitted on the other folds."""
    p = np.empty(len(held))
    for k in range(config.folds):
        rest = fold != k
        p[~rest] = raw_probability(fit_trees(features[rest], held[rest], config), features[~rest])
    return p


def learning_curve(
    trials: Trials, shares: tuple[float, ...], config: TrainConfig
) -> list[tuple[int, Float[np.ndarray, "n"]]]:
    """Number of trials and out-of-fold raw probability when only that share of the other folds' scenes is used.

    Shares that leave too little to fit are left out.
    """
    fold = fold_of(trials.scene_key, config.folds, config.seed)
    scenes = np.unique(trials.scene_key)
    order = np.random.default_rng(config.seed + 1).permutation(len(scenes))
    rank = order[np.searchsorted(scenes, trials.scene_key)] / len(scenes)
    curve = []
    for share in shares:
        p, used = np.empty(len(trials)), []
        for k in range(config.folds):
            rest, test = (fold != k) & (rank < share), fold == k
            if len(np.unique(trials.delivered[rest])) < 2:
                break
            model = fit_trees(trials.features[rest], trials.delivered[rest], config)
            p[test] = raw_probability(model, trials.features[test])
            used.append(int(rest.sum()))
        else:
            curve.append((sum(used) // config.folds, p))
    return curve
