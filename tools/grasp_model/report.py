"""The report on a trained score: markdown with intervals, and the calibration curve as a picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tools.grasp_model.dataset import Cause, Policy, Trials
from tools.grasp_model.evaluation import (
    Share,
    auc,
    best_per_group,
    brier,
    calibration_error,
    clustered_share,
    log_loss,
    paired_difference,
    permutation_importance,
    reliability,
    wilson,
)
from tools.grasp_model.snapshot import Eyes
from tools.grasp_model.train import (
    Fit,
    TrainConfig,
    fit,
    fit_trees,
    fold_of,
    learning_curve,
    raw_probability,
)

Rows = Sequence[Sequence[object]]


@dataclass(frozen=True)
class Group:
    """A part of the trials under one heading."""

    name: str
    rows: np.ndarray


def table(header: Sequence[str], rows: Rows) -> str:
    """A markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def groups_of(trials: Trials) -> list[Group]:
    """All, structured, piles, and kinds unseen in training."""
    s, h = trials.structured, trials.held_out
    named = [
        ("all scenes, known kinds", ~h),
        ("structured, known kinds", s & ~h),
        ("piles, known kinds", ~s & ~h),
        ("all scenes, unseen kinds", h),
        ("structured, unseen kinds", s & h),
        ("piles, unseen kinds", ~s & h),
    ]
    return [Group(name, rows) for name, rows in named if rows.any()]


def scores_section(trials: Trials, fitted: Fit) -> str:
    """Out-of-fold quality of the learned score against the hand-written one."""
    rows = []
    for name, p in (
        ("hand-written", trials.p_hand.astype(float)),
        ("learned, raw", fitted.p_raw),
        ("learned, calibrated", fitted.p),
    ):
        s, u = trials.structured, ~trials.structured
        rows.append(
            [
                name,
                f"{auc(p, trials.delivered):.3f}",
                f"{auc(p[s], trials.delivered[s]):.3f}",
                f"{auc(p[u], trials.delivered[u]):.3f}",
                f"{log_loss(p, trials.delivered):.3f}",
                f"{brier(p, trials.delivered):.3f}",
                f"{calibration_error(p, trials.delivered):.3f}",
            ]
        )
    header = ["score", "AUC", "AUC structured", "AUC piles", "log loss", "Brier", "calibration error"]
    return table(header, rows)


_SEEN_WITH = {
    Eyes.EXACT: "exact masks, exact depth",
    Eyes.NOISE: "the same with the noise of `--noise`",
    Eyes.SGBM: "exact masks, `sgbm`",
    Eyes.OWN: "`embedded`, exact depth",
    Eyes.OWN_SGBM: "`embedded`, `sgbm`",
}


def eyes_section(trials: Trials, p: Float[np.ndarray, "n"]) -> str:
    """Promise against outcome by what the snapshots were seen with."""
    rows = []
    for eyes, what in _SEEN_WITH.items():
        mine = trials.eyes == eyes
        if mine.any():
            held, promised = trials.delivered[mine], p[mine]
            error = f"{calibration_error(promised, held):.3f}"
            rows.append(
                [
                    what,
                    len(held),
                    f"{promised.mean():.3f}",
                    f"{held.mean():.3f}",
                    f"{auc(promised, held):.3f}",
                    error,
                ]
            )
    return table(["masks and depth", "trials", "promised", "delivered", "AUC", "calibration error"], rows)


def reliability_section(p: Float[np.ndarray, "n"], trials: Trials) -> str:
    """Predicted against observed."""
    rows = [
        [f"{b.low:.2f}-{b.high:.2f}", f"{b.mean_p:.3f}", str(b.held), b.held.count]
        for b in reliability(p, trials.delivered)
    ]
    return table(["predicted", "mean predicted", "delivered", "trials"], rows)


def causes_section(trials: Trials) -> str:
    """How trials ended."""
    rows = []
    for name, part in (("structured", trials.structured), ("piles", ~trials.structured)):
        n = int(part.sum())
        counts = np.bincount(trials.cause[part], minlength=len(Cause))
        rows.append([name, n, *(f"{100 * counts[c] / max(n, 1):.1f} %" for c in Cause if c != Cause.BROKEN)])
    return table(
        ["scenes", "trials", *(c.name.lower().replace("_", " ") for c in Cause if c != Cause.BROKEN)], rows
    )


def curve_section(trials: Trials, fitted: Fit, config: TrainConfig, shares: tuple[float, ...]) -> str:
    """Quality against the number of training trials; the last row is that of the fit itself."""
    all_rows = len(trials) * (config.folds - 1) // config.folds
    curve = [*learning_curve(trials, shares, config), (all_rows, fitted.p_raw)]
    rows = [[n, f"{auc(p, trials.delivered):.3f}", f"{log_loss(p, trials.delivered):.3f}"] for n, p in curve]
    return table(["trials", "AUC", "log loss"], rows)


def choices_section(trials: Trials, rng: np.random.Generator) -> str:
    """One try per visible object of unseen scenes, by policy: the choice that the planner really makes."""
    policies = (Policy.TOP_MODEL, Policy.TOP_HAND, Policy.RANDOM)
    rows = []
    for group in groups_of(trials):
        part = trials[group.rows]
        cells: list[object] = [group.name, len(np.unique(part.scene_key)), len(np.unique(part.object_key))]
        for policy in policies:
            tried = part[part.policy == policy]
            cells.append(clustered_share(tried.delivered, tried.scene_key, rng))
        cells.append(_gain(part, rng))
        rows.append(cells)
    return table(
        ["objects", "scenes", "choices", "learned", "hand-written", "random valid", "learned - hand"], rows
    )


def _gain(part: Trials, rng: np.random.Generator) -> Share:
    """Learned minus hand-written over the objects that both tried."""
    a, b = part[part.policy == Policy.TOP_MODEL], part[part.policy == Policy.TOP_HAND]
    common, i, j = np.intersect1d(a.object_key, b.object_key, return_indices=True)
    return paired_difference(a.delivered[i], b.delivered[j], common // 4096, rng)


def best_of_scene_section(trials: Trials, p: Float[np.ndarray, "n"]) -> str:
    """Success by the probability of the chosen grasp, and of the most probable object of each snapshot."""
    chosen = trials.policy == Policy.TOP_MODEL
    part, q = trials[chosen], p[chosen]
    rows: list[list[object]] = []
    for low in (0.0, 0.5, 0.7, 0.8, 0.9, 0.95):
        inside = q >= low
        share = wilson(int(part.delivered[inside].sum()), int(inside.sum()))
        rows.append([f"p >= {low:.2f}", f"{100 * inside.mean():.0f} %", share])
    best = best_per_group(q, part.object_key // 64)
    rows.append(
        ["best object of each snapshot", len(best), wilson(int(part.delivered[best].sum()), len(best))]
    )
    return table(["chosen grasps", "share kept", "delivered"], rows)


def kinds_section(trials: Trials, count: int = 12) -> str:
    """The kinds on which the learned choice fails most."""
    part = trials[trials.policy == Policy.TOP_MODEL]
    rows = []
    for kind in np.unique(part.kind):
        of = part.kind == kind
        share = wilson(int(part.delivered[of].sum()), int(of.sum()))
        unseen = "unseen" if part.held_out[of].any() else ""
        rows.append((share.value, [kind, unseen, share, share.count]))
    worst = [row for _, row in sorted(rows, key=lambda r: (r[0], str(r[1][0])))[:count]]
    return table(["kind", "", "delivered", "choices"], worst)


def importance_section(trials: Trials, config: TrainConfig, rng: np.random.Generator, count: int = 20) -> str:
    """Loss of AUC on one held-out fold when a feature is shuffled."""
    test = fold_of(trials.scene_key, config.folds, config.seed) == 0
    model = fit_trees(trials.features[~test], trials.delivered[~test], config)
    loss = permutation_importance(
        lambda x: raw_probability(model, x), trials.features[test], trials.delivered[test], rng
    )
    top = np.argsort(-loss)[:count]
    return table(["feature", "loss of AUC"], [[trials.feature_names[j], f"{loss[j]:.4f}"] for j in top])


def draw_calibration(path: Path, trials: Trials, curves: Sequence[tuple[str, np.ndarray]]) -> None:
    """Reliability diagram of several scores, with the number of trials per bin below."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, (top, below) = plt.subplots(
        2, 1, figsize=(6, 6.6), height_ratios=(4, 1), sharex=True, layout="constrained"
    )
    top.plot([0, 1], [0, 1], color="0.7", linewidth=1)
    for name, p in curves:
        bins = reliability(p, trials.delivered)
        x, y = [b.mean_p for b in bins], np.array([b.held.value for b in bins])
        spread = np.array([[b.held.value - b.held.low, b.held.high - b.held.value] for b in bins]).T
        top.errorbar(x, y, yerr=spread, marker="o", markersize=4, capsize=2, linewidth=1.2, label=name)
    top.set(ylabel="delivered", ylim=(0, 1.02), title=f"{len(trials)} trials, predictions on unseen scenes")
    top.legend(frameon=False)
    below.hist(curves[-1][1], bins=np.linspace(0, 1, 41), color="0.55")
    below.set(xlabel="predicted probability", ylabel="trials", xlim=(0, 1))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def write_report(
    train: Trials,
    held_out: Trials | None,
    out: Path,
    picture: Path,
    config: TrainConfig,
    notes: str = "",
    seed: int = 0,
) -> Fit:
    """Fit with cross-validation, and write the markdown and the picture.

    Args:
        train: the trials that the model was trained with.
        held_out: what `evaluate` tried with it.
        out, picture: files.
        config: settings of the fit.
        notes: the model's own, as stored with it.
        seed: of the bootstrap.
    """
    rng = np.random.default_rng(seed)
    fitted = fit(train, config)
    curves = [("hand-written", train.p_hand.astype(float)), ("raw", fitted.p_raw), ("calibrated", fitted.p)]
    draw_calibration(picture, train, curves)
    parts = [_opening(train, notes), "## How trials ended\n", causes_section(train)]
    parts += ["## Quality on unseen scenes (cross-validated by scene)\n", scores_section(train, fitted)]
    parts += ["### By what the scene was seen with\n", eyes_section(train, fitted.p)]
    parts += [
        "### Calibration\n",
        f"![calibration]({picture.name})\n",
        reliability_section(fitted.p, train),
    ]
    parts += ["### Learning curve\n", curve_section(train, fitted, config, (0.03, 0.06, 0.12, 0.25, 0.5))]
    if held_out is not None and len(held_out):
        p = fitted.predict(held_out.features)
        parts += _choice_parts(held_out, p, rng)
    parts += ["## Which features matter\n", importance_section(train, config, rng), _LIMITS]
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(parts))
    return fitted


def _choice_parts(held_out: Trials, p: np.ndarray, rng: np.random.Generator) -> list[str]:
    """The sections on one try per object."""
    chosen = held_out[held_out.policy == Policy.TOP_MODEL]
    return [
        "## One try per object on fresh scenes\n",
        "Every visible object with a valid grasp (for the gripper alone), tried once from the same snapshot by each "
        "rule. Intervals: bootstrap by scene, 95 %.\n",
        choices_section(held_out, rng),
        "By the probability of the grasp that the learned score chose:\n",
        best_of_scene_section(held_out, p),
        "How the learned choices ended:\n",
        causes_section(chosen),
        "Kinds on which they fail most:\n",
        kinds_section(held_out),
    ]


_LIMITS = """## What this does not cover

- The arm: a real pick also needs a reachable, collision-free arm, and its approach may differ by a few millimetres.
- Reality: rigid objects, friction coefficients near 1 on the pads; depth and masks of a simulated camera.
- One snapshot: the occlusion volume in training knows one view of the scene; later in an episode it knows more.
"""


def _opening(train: Trials, notes: str) -> str:
    scenes = len(np.unique(train.scene_key))
    seeds = ", ".join(str(s) for s in np.unique(train.seed))
    return (
        "# The learned grasp score\n\n"
        f"Gradient-boosted trees on {len(train.feature_names)} features of a grasp candidate, fitted to {len(train)} "
        f"simulated trials in {scenes} scenes ({train.delivered.mean():.2f} of them delivered), then calibrated. In a "
        "trial a floating, force-limited 2F-85 approaches, closes, lifts 15 cm, and carries the object to the bin in "
        "1.8 s while it turns to point down. *Delivered* means that the object is then between both fingers. There is "
        "no arm. In a checkout after `scripts/setup dev`, `python -m tools.grasp_model collect`, `train`, `evaluate` "
        f"and `report` make all this; seeds of the scenes: {seeds}.\n\n"
        "All tables here are of these trials. The best of many candidates is promised too much, and no arm floats. So "
        "`recalibrate` finally fits the promise to whole trials, which keeps the order of the grasps: once with exact "
        "depth, and once with a sensor's errors (`--rough`). "
        f"Notes stored with the model: {notes or 'none'}.\n"
    )
