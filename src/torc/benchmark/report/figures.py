"""The figures: the paper's 9 and 10 from our trials, with the paper's own values beside them, and every problem.

Colours are those of M. Okabe and K. Ito, which people of every colour vision can distinguish; hatches and markers
repeat the distinction. matplotlib is imported when the first figure is drawn.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from torc.benchmark.measures import DROP_FREE, SUCCESS, within
from torc.benchmark.paper import PaperMethod, paper_method, paper_success
from torc.benchmark.report.cells import words
from torc.benchmark.rows import Table, TrialRow
from torc.errors import MissingDependencyError, extra_remedy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLORS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#F0E442", "#666666")
_GRAY, _INK = "#C8C8C8", "#1E1E1E"
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.prop_cycle": f"cycler('color', {_COLORS})",
    "hatch.linewidth": 0.6,
}
_MAX_POINTS = 400
_LONG_NAME = 24
_MARKERS = "osD^v<>P"


@dataclass(frozen=True)
class Picture:
    """A drawn figure: `name` of its files, `text` for those who do not see it; `wide` if it takes the whole page."""

    name: str
    title: str
    text: str
    svg: bytes
    png: bytes
    wide: bool = False


def draw_all(table: Table, planners: Sequence[str]) -> list[Picture]:
    """Draw all figures, planners in the given order; those without a completed trial are left out.

    Raises MissingDependencyError if matplotlib is not installed.
    """
    shown = [p for p in planners if table.completed(p)]
    if not shown:
        return []
    try:
        import matplotlib
    except ImportError:
        raise MissingDependencyError("matplotlib, which draws the figures,", extra_remedy("report")) from None
    pictures = []
    for name, (draw, title) in _FIGURES.items():
        svg, png, (text,) = io.BytesIO(), io.BytesIO(), words()[f"Figure: {title}"]
        with matplotlib.rc_context({**_STYLE, "svg.hashsalt": name}):
            figure = draw(table, shown)
            figure.tight_layout()
            figure.savefig(svg, format="svg", metadata={"Date": None})
            figure.savefig(png, format="png", dpi=150)
        if table.all_real:
            title = title.replace("figure 9", "figure 11").replace("figure 10", "figure 12")
        if table.all_real and name in ("picks", "decision_time"):
            text = f"{text.partition(' Diamonds:')[0]} The paper draws its own without numbers."
        pictures.append(Picture(name, title, text, svg.getvalue(), png.getvalue(), draw is _problems))
    return pictures


def _success(table: Table, planners: list[str]) -> Figure:
    figure, (axes,) = _new_figure(max(5.4, 1.8 + 0.85 * len(planners)), 3.8)
    for i, planner in enumerate(planners):
        done = table.completed(planner)
        success, clean = SUCCESS.of(done), DROP_FREE.of(done)
        axes.bar(i, clean.value, 0.62, color=f"C{i}", label=None if i else "with no drop")
        look: dict[str, Any] = {"color": _GRAY, "hatch": "///", "edgecolor": "white"}
        look["label"] = None if i else "with drops"
        axes.bar(i, success.value - clean.value, 0.62, clean.value, **look)
        if np.isfinite(success.high):
            ends = [[max(success.value - success.low, 0.0)], [max(success.high - success.value, 0.0)]]
            axes.errorbar(i, success.value, ends, color=_INK, capsize=4, linewidth=1.3, zorder=3)
        _mark_paper(axes, i, paper_method(planner, table.all_real), lambda m: [m.success, m.drop_free])
    axes.set_ylim(0, 1.04)
    axes.set_ylabel("share of trials")
    _name_planners(axes, planners)
    return figure


def _boxes(
    table: Table,
    planners: list[str],
    values: Callable[[TrialRow], list[float]],
    paper: Callable[[PaperMethod], list[float]],
    label: str,
    log: bool = False,
) -> Figure:
    """Draw a box and points of all values of each planner's completed trials."""
    figure, (axes,) = _new_figure(max(5.4, 1.8 + 0.85 * len(planners)), 3.8)
    rng = np.random.default_rng(0)
    for i, planner in enumerate(planners):
        points = np.array([v for row in table.completed(planner) for v in values(row)], dtype=float)
        if len(points):
            look: dict[str, Any] = {"boxprops": {"facecolor": f"C{i}", "alpha": 0.35, "edgecolor": _INK}}
            look["medianprops"] = {"color": _INK, "linewidth": 2.2}
            axes.boxplot(points, positions=[i], widths=0.5, showfliers=False, patch_artist=True, **look)
            if len(points) > _MAX_POINTS:
                points = rng.choice(points, _MAX_POINTS, replace=False)
            beside = i + rng.uniform(-0.2, 0.2, len(points))
            axes.scatter(beside, points, 7, color=f"C{i}", alpha=0.6, zorder=3)
        _mark_paper(axes, i, paper_method(planner, table.all_real), paper)
    axes.set_ylabel(label)
    axes.set_yscale("log" if log else "linear")
    _name_planners(axes, planners)
    return figure


def _within(table: Table, planners: list[str]) -> Figure:
    columns = 1 if max(map(len, planners)) > _LONG_NAME else 3
    figure, (axes,) = _new_figure(6.4, 4.0 + 0.24 * (-(-len(planners) // columns)))
    budget = max(r.max_picks for r in table.rows)
    picks = np.arange(1, budget + 1)
    for i, planner in enumerate(planners):
        found = [within(table.completed(planner), int(k)) for k in picks]
        look: dict[str, Any] = {"color": f"C{i}", "marker": _MARKERS[i % len(_MARKERS)], "markersize": 4}
        axes.plot(picks, [f.value for f in found], **look, linewidth=1.5, label=planner)
        axes.fill_between(picks, [f.low for f in found], [f.high for f in found], color=f"C{i}", alpha=0.12)
    axes.set_ylim(0, 1.04)
    axes.set_xlim(0.8, budget + 0.2)
    axes.set_xticks(picks[:: 1 + budget // 21])
    axes.set_xlabel("picks")
    axes.set_ylabel("share of trials retrieved by then")
    below: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.13), "ncols": columns}
    axes.legend(**below, frameon=False, fontsize=9)
    return figure


def _problems(table: Table, planners: list[str]) -> Figure:
    names, budget = table.problems, max(r.max_picks for r in table.rows)
    figure, (left, right) = _new_figure(max(7.0, 3.4 + 1.5 * len(planners)), 1.8 + 0.27 * len(names), 2)
    good = np.full((2, len(names), len(planners)), np.nan)
    texts = np.full(good.shape, "", dtype=object)
    for j, planner in enumerate(planners):
        done = table.completed(planner)
        for i, problem in enumerate(names):
            if rows := [r for r in done if r.problem == problem]:
                success, cost = np.mean([r.solved for r in rows]), np.mean([r.cost for r in rows])
                published = paper_success(problem, planner)
                good[:, i, j] = success, (budget - cost) / max(budget - 1, 1)
                texts[0, i, j] = f"{success:.2f}" + ("" if published is None else f" ({published:.2f})")
                texts[1, i, j] = f"{cost:.1f}"
    for k, (axes, title) in enumerate(((left, "share retrieved"), (right, "picks to retrieval"))):
        axes.imshow(good[k], cmap="cividis", vmin=0, vmax=1, aspect="auto")
        for (i, j), text in np.ndenumerate(texts[k]):
            ink = "black" if good[k, i, j] > 0.5 else "white"
            axes.text(j, i, text, ha="center", va="center", color=ink, fontsize=8)
        axes.set_title(title, fontsize=10)
        axes.spines[:].set_visible(False)
        _name_planners(axes, planners, legend=False)
        axes.set_xlim(-0.5, len(planners) - 0.5)
    left.set_yticks(range(len(names)), names)
    right.set_yticks([])
    return figure


def _new_figure(width: float, height: float, columns: int = 1) -> tuple[Figure, Any]:
    """Return a figure with axes side by side; inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(1, columns, squeeze=False)[0]


def _name_planners(axes: Axes, planners: list[str], legend: bool = True) -> None:
    """Write the planners along the x axis, the legend above."""
    axes.set_xticks(range(len(planners)), [p.replace("[", "\n[") for p in planners], rotation=20, ha="right")
    axes.set_xlim(-0.6, len(planners) - 0.4)
    if legend and axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.16), ncols=3, frameon=False, fontsize=9)


def _mark_paper(
    axes: Axes, i: int, method: PaperMethod | None, values: Callable[[PaperMethod], list[float]]
) -> None:
    """Mark the paper's values beside a planner's; the first marks make the entry of the legend."""
    if marks := values(method) if method else []:
        label = None if "the paper" in axes.get_legend_handles_labels()[1] else "the paper"
        look: dict[str, Any] = {"marker": "D", "s": 46, "facecolor": "white", "edgecolor": _INK}
        axes.scatter([i + 0.36] * len(marks), marks, **look, linewidth=1.3, zorder=5, label=label)


_FIGURES: dict[str, tuple[Callable[[Table, list[str]], Figure], str]] = {
    "success": (_success, "Success (the paper's figure 9, left)"),
    "picks": (
        partial(
            _boxes,
            values=lambda r: [r.picks],
            paper=lambda m: [] if m.picks is None else [m.picks],
            label="picks per trial",
        ),
        "Picks required (the paper's figure 9, right)",
    ),
    "within": (_within, "Retrieved within k picks"),
    "drops": (
        partial(
            _boxes, values=lambda r: [r.drops], paper=lambda m: [m.drops], label="objects dropped per trial"
        ),
        "Objects dropped (the paper's figure 10, left)",
    ),
    "decision_time": (
        partial(
            _boxes,
            values=lambda r: [max(p.decision_s, 1e-4) for p in r.picked],
            paper=lambda m: [] if m.decision_s is None else [m.decision_s],
            label="seconds per decision",
            log=True,
        ),
        "Decision time (the paper's figure 10, right)",
    ),
    "problems": (_problems, "Every problem"),
}
"""How each figure is drawn, and its title."""
